#include "train/step/shared_soup.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>
#include <numeric>

#include "args/fetch_features.h"
#include "args/sort_gradients.h"

namespace trisoup::train {
namespace {

using kernels::Hit;
constexpr std::size_t kFeatures = 7, kFeatureStride = 8;
constexpr std::size_t kMlp = soup::Mlp::kParameters;

/// First word of every message in the exchange of agree_on_winners().
enum Flag : std::uint32_t { kOverflow = 1, kStop = 2 };

/// Whether `a` is visible in front of `b`, as in visibility.comp: lower depth, then lower triangle index. Both must
/// show a triangle.
bool wins(const Hit& a, const Hit& b) { return a.depth < b.depth || (a.depth == b.depth && a.triangle < b.triangle); }

/// Range of the pixels for which `rank` determines the nearest fragment.
std::pair<std::size_t, std::size_t> slice_of(std::size_t pixels, int rank, int ranks) {
  return {pixels * static_cast<std::size_t>(rank) / static_cast<std::size_t>(ranks),
          pixels * (static_cast<std::size_t>(rank) + 1) / static_cast<std::size_t>(ranks)};
}

template <typename T>
void append(ranks::Bytes& to, std::span<const T> values) {
  const auto bytes = std::as_bytes(values);
  to.insert(to.end(), bytes.begin(), bytes.end());
}

std::vector<ranks::ByteView> views_of(const std::vector<ranks::Bytes>& messages) {
  return {messages.begin(), messages.end()};
}

/// Reads the values of a message in order. Sender and receiver derive the length from the same images, so a short
/// message comes from another build.
class Reader {
 public:
  explicit Reader(ranks::ByteView bytes) : bytes_(bytes) {}
  void take(std::span<float> values) {
    if (bytes_.size() < values.size_bytes())
      throw Error("ranks: a message is too short; run the same build on all ranks");
    std::memcpy(values.data(), bytes_.data(), values.size_bytes());
    bytes_ = bytes_.subspan(values.size_bytes());
  }

 private:
  ranks::ByteView bytes_;
};

}  // namespace

std::vector<std::uint16_t> shaders_of(const BatchLayout& batch, std::uint32_t groups, int ranks) {
  constexpr std::uint32_t kBlock = 16;
  std::vector<std::uint16_t> shaders(batch.pixels);
  for (const kernels::ViewRecord& view : batch.records) {
    const std::uint32_t blocks_x = (view.width + kBlock - 1) / kBlock;
    for (std::uint32_t y = 0; y < view.height; ++y)
      for (std::uint32_t x = 0; x < view.width; ++x) {
        const std::uint32_t block = view.block_offset + y / kBlock * blocks_x + x / kBlock;
        shaders[view.pixel_offset + std::size_t(y) * view.width + x] =
            static_cast<std::uint16_t>(block % groups % static_cast<std::uint32_t>(ranks));
      }
  }
  return shaders;
}

template <typename Visit>
void SharedSoup::each_pixel(Visit&& visit) const {
  for (std::size_t p = 0; p < hits_.size(); ++p)
    if (hits_[p].triangle != 0) visit(p, owners_[p], shaders_[p]);
}

void SharedSoup::grow(gpu::Buffer& buffer, std::uint64_t bytes, const char* what) {
  if (bytes <= buffer.bytes()) return;
  buffer = {};
  buffer = gpu_.allocate(bytes, what);
  gpu_.fill(buffer.address(), bytes, 0);
}

void SharedSoup::place_batch() {
  const BatchLayout& batch = buffers_.batch();
  std::vector<std::uint64_t> sizes{buffers_.mlp_groups};
  for (const kernels::ViewRecord& view : batch.records) sizes.push_back(std::uint64_t(view.width) << 32 | view.height);
  if (sizes != shaders_for_) {
    shaders_ = shaders_of(batch, buffers_.mlp_groups, ranks_.size());
    shaders_for_ = std::move(sizes);
  }
  hits_.resize(batch.pixels);
  owners_.resize(batch.pixels);
}

void SharedSoup::place_stand_in() {
  const std::uint64_t pixels = buffers_.batch().pixels;
  if (pixels * sizeof(Hit) <= hits_here_.bytes()) return;
  grow(hits_here_, pixels * sizeof(Hit), "fragments to shade");
  grow(textures_here_, pixels * sizeof(kernels::Texture), "fragments to shade");
  grow(features_, (pixels + 2) * kFeatureStride * 4, "features of fragments");
  grow(places_, pixels * 4, "fragments to shade");
  grow(zeroes_, pixels * 4, "fragments to shade");
  grow(gradient_, pixels * 36, "feature gradients");
  std::vector<kernels::Texture> rows(pixels);
  std::vector<std::uint32_t> places(pixels);
  for (std::uint32_t p = 0; p < pixels; ++p) rows[p].lattice_offset = places[p] = p;
  gpu_.upload(textures_here_.address(), rows);
  gpu_.upload(places_.address(), places);
}

ShadedFrom SharedSoup::stand_in() const {
  // A fragment at barycentrics 0, 0 of a texture of level 0 is that texture's first sample, the other two having no
  // weight.
  return {hits_here_.address(),
          textures_here_.address(),
          features_.address(),
          places_.address(),
          zeroes_.address(),
          gradient_.address(),
          false};
}

void SharedSoup::agree_on_winners() {
  place_batch();
  const int ranks = size();
  const auto control = gpu_.download_vector<kernels::Control>(buffers_.control.address(), 1)[0];
  const std::uint32_t flags = (control.overflow != 0 ? kOverflow : 0u) | (stop_ ? kStop : 0u);
  gpu_.download(buffers_.hits.address(), std::as_writable_bytes(std::span(hits_)));
  std::vector<ranks::Bytes> messages(static_cast<std::size_t>(ranks));
  for (int r = 0; r < ranks; ++r) {
    ranks::Bytes& message = messages[static_cast<std::size_t>(r)];
    append<std::uint32_t>(message, {&flags, 1});
    if (flags != 0) continue;
    const auto [first, last] = slice_of(hits_.size(), r, ranks);
    std::vector<Candidate> candidates;
    for (std::size_t p = first; p < last; ++p)
      if (hits_[p].triangle != 0) candidates.push_back({static_cast<std::uint32_t>(p), hits_[p]});
    append<Candidate>(message, candidates);
  }
  const std::vector<ranks::Bytes> received = ranks_.exchange(views_of(messages));
  std::uint32_t all_flags = 0;
  for (const ranks::Bytes& message : received)
    all_flags |= ranks::values_of<std::uint32_t>(ranks::ByteView(message).first(4))[0];
  outcome_ = all_flags & kStop ? Outcome::stopped : all_flags & kOverflow ? Outcome::overflow : Outcome::done;
  if (outcome_ != Outcome::done) return;

  const auto [first, last] = slice_of(hits_.size(), ranks_.rank(), ranks);
  std::vector<Hit> winners(last - first);
  for (const ranks::Bytes& message : received)
    for (const Candidate& c : ranks::values_of<Candidate>(ranks::ByteView(message).subspan(4))) {
      if (c.pixel < first || c.pixel >= last)
        throw Error("ranks: a message has pixels of another rank; run the same build on all ranks");
      Hit& winner = winners[c.pixel - first];
      if (winner.triangle == 0 || wins(c.hit, winner)) winner = c.hit;
    }
  const std::vector<ranks::Bytes> slices = ranks_.all_gather(ranks::bytes_of(winners));
  auto to = std::as_writable_bytes(std::span(hits_)).begin();
  for (const ranks::Bytes& slice : slices) to = std::copy(slice.begin(), slice.end(), to);
  gpu_.upload(buffers_.hits.address(), hits_);
  const auto owner_of = [&](std::uint32_t triangle) {
    const auto above = std::upper_bound(soup_.ranges.begin(), soup_.ranges.end(), triangle,
                                        [](std::uint32_t t, const TriangleRange& range) { return t < range.last; });
    return static_cast<std::uint16_t>(above - soup_.ranges.begin());
  };
  for (std::size_t p = 0; p < hits_.size(); ++p)
    if (hits_[p].triangle != 0) owners_[p] = owner_of(hits_[p].triangle - 1);
}

ShadedFrom SharedSoup::shaded_from(const ShadedFrom&, bool coarser) {
  place_stand_in();
  const auto pixels = static_cast<std::uint32_t>(hits_.size());
  const auto self = static_cast<std::uint16_t>(ranks_.rank());
  gpu_.launch({"fetch_features"}, (pixels + 63) / 64,
              kernels::FetchFeaturesArgs{buffers_.hits.address(), soup_.textures.address(), soup_.lattice.address(),
                                         features_.address(), pixels, soup_.own().first, soup_.own().last, coarser});
  features_here_.resize((pixels + 2) * kFeatureStride);
  gpu_.download(features_.address(), std::as_writable_bytes(std::span(features_here_)));
  std::vector<ranks::Bytes> messages(static_cast<std::size_t>(ranks_.size()));
  each_pixel([&](std::size_t p, std::uint16_t owner, std::uint16_t shader) {
    if (owner == self && shader != self)
      append<float>(messages[shader], {&features_here_[p * kFeatureStride], kFeatures});
  });
  const std::vector<ranks::Bytes> received = ranks_.exchange(views_of(messages));
  std::vector<Reader> readers(received.begin(), received.end());
  std::vector<Hit> here(pixels);
  each_pixel([&](std::size_t p, std::uint16_t owner, std::uint16_t shader) {
    if (shader != self) return;
    here[p] = {static_cast<std::uint32_t>(p) + 1, 0.0f, 0.0f, hits_[p].depth};
    if (owner != self) readers[owner].take({&features_here_[p * kFeatureStride], kFeatures});
  });
  gpu_.upload(features_.address(), features_here_);
  gpu_.upload(hits_here_.address(), here);
  return stand_in();
}

void SharedSoup::share_colours() {
  const auto self = static_cast<std::uint16_t>(ranks_.rank());
  // Pixels that show no triangle have the background's colour on every rank already.
  auto colours = gpu_.download_vector<float>(buffers_.colour.address(), 3 * hits_.size());
  ranks::Bytes mine;
  each_pixel([&](std::size_t p, std::uint16_t, std::uint16_t shader) {
    if (shader == self) append<float>(mine, {&colours[3 * p], 3});
  });
  const std::vector<ranks::Bytes> received = ranks_.all_gather(mine);
  std::vector<Reader> readers(received.begin(), received.end());
  each_pixel([&](std::size_t p, std::uint16_t, std::uint16_t shader) { readers[shader].take({&colours[3 * p], 3}); });
  gpu_.upload(buffers_.colour.address(), colours);
}

void SharedSoup::share_gradients() {
  const std::size_t pixels = hits_.size(), ranks = static_cast<std::size_t>(ranks_.size()),
                    groups = buffers_.mlp_groups;
  const auto self = static_cast<std::uint16_t>(ranks_.rank());
  auto gradient = gpu_.download_vector<float>(gradient_.address(), kFeatures * pixels);
  auto sums = gpu_.download_vector<float>(buffers_.mlp_partial.address(), groups * kMlp);
  const auto each_group_of = [&](std::size_t rank, const auto& visit) {
    for (std::size_t g = rank; g < groups; g += ranks) visit(std::span(sums).subspan(g * kMlp, kMlp));
  };
  std::vector<ranks::Bytes> messages(ranks);
  for (ranks::Bytes& message : messages)
    each_group_of(self, [&](std::span<float> row) { append<float>(message, row); });
  std::array<float, kFeatures> own{};
  each_pixel([&](std::size_t p, std::uint16_t owner, std::uint16_t shader) {
    if (shader != self || owner == self) return;
    for (std::size_t c = 0; c < kFeatures; ++c) own[c] = gradient[c * pixels + p];
    append<float>(messages[owner], own);
  });
  const std::vector<ranks::Bytes> received = ranks_.exchange(views_of(messages));
  std::vector<Reader> readers(received.begin(), received.end());
  for (std::size_t r = 0; r < ranks; ++r) each_group_of(r, [&](std::span<float> row) { readers[r].take(row); });
  each_pixel([&](std::size_t p, std::uint16_t owner, std::uint16_t shader) {
    if (owner != self || shader == self) return;
    readers[shader].take(own);
    for (std::size_t c = 0; c < kFeatures; ++c) gradient[c * pixels + p] = own[c];
  });
  gpu_.upload(buffers_.mlp_partial.address(), sums);
  gpu_.upload(gradient_.address(), gradient);
  gpu_.launch(
      {"sort_gradients"}, (pixels + 63) / 64,
      kernels::SortGradientsArgs{buffers_.hits.address(), buffers_.shown.address() + 4 * (soup_.triangles + 1ull),
                                 buffers_.ranks.address(), gradient_.address(), buffers_.sorted(),
                                 static_cast<std::uint32_t>(pixels), soup_.own().first, soup_.own().last, 0});
}

Parents SharedSoup::parents_of(std::span<const std::uint32_t> parents, std::span<const TriangleRange> ranges) const {
  Parents found;
  for (const TriangleRange& range : ranges) {
    std::vector<std::uint32_t>& all =
        found.needed.emplace_back(parents.begin() + range.first, parents.begin() + range.last);
    std::sort(all.begin(), all.end());
    all.erase(std::unique(all.begin(), all.end()), all.end());
  }
  const auto self = static_cast<std::size_t>(rank());
  const std::vector<std::uint32_t>& here = found.needed[self];
  for (const std::uint32_t t : here) {
    found.rows.push_back(
        {static_cast<std::uint32_t>(found.samples), 0, soup_.table[t].level_min, soup_.table[t].level_max});
    found.samples += soup_.source_at(t + 1) - soup_.source_at(t);
  }
  for (std::uint32_t t = ranges[self].first; t < ranges[self].last; ++t)
    found.numbers.push_back(
        static_cast<std::uint32_t>(std::lower_bound(here.begin(), here.end(), parents[t]) - here.begin()));
  return found;
}

gpu::Buffer SharedSoup::fetch(const Parents& parents, gpu::Buffer pool) {
  constexpr std::size_t kChannels = soup::kChannels;
  const TriangleRange own = soup_.own();
  std::vector<ranks::Bytes> messages(static_cast<std::size_t>(size()));
  {
    const std::vector<float> mine = own_values(pool);
    const auto values_at = [&](std::uint32_t t) {
      return std::span(mine).subspan((soup_.source_at(t) - soup_.source_at(own.first)) * kChannels,
                                     (soup_.source_at(t + 1) - soup_.source_at(t)) * kChannels);
    };
    for (std::size_t r = 0; r < messages.size(); ++r)
      for (const std::uint32_t t : parents.needed[r])
        if (t >= own.first && t < own.last) append<float>(messages[r], values_at(t));
  }
  pool = {};  // free it: the messages contain what is needed
  const std::vector<ranks::Bytes> received = ranks_.exchange(views_of(messages));
  // Ranks own ascending ranges of triangles, so the messages in order of rank are in order of triangles.
  gpu::Buffer fetched = gpu_.allocate(std::max<std::uint64_t>(parents.samples, 1) * kChannels * 4, "textures");
  std::uint64_t bytes = 0;
  for (const ranks::Bytes& message : received) {
    if (bytes + message.size() > parents.samples * kChannels * 4) break;
    if (!message.empty()) gpu_.upload(fetched.address() + bytes, message);
    bytes += message.size();
  }
  if (bytes != parents.samples * kChannels * 4)
    throw Error("ranks: a message has the wrong size for the textures; run the same build on all ranks");
  return fetched;
}

ranks::Bytes SharedSoup::all_gather(ranks::ByteView mine) {
  ranks::Bytes all;
  for (const ranks::Bytes& part : ranks_.all_gather(mine)) all.insert(all.end(), part.begin(), part.end());
  return all;
}

ranks::Bytes SharedSoup::gather_on_first(ranks::ByteView mine) {
  std::vector<ranks::ByteView> to(static_cast<std::size_t>(size()));
  to[0] = mine;
  ranks::Bytes all;
  for (const ranks::Bytes& part : ranks_.exchange(to)) all.insert(all.end(), part.begin(), part.end());
  return all;
}

ranks::Bytes SharedSoup::scatter_from_first(ranks::ByteView all, std::uint64_t size) {
  std::vector<ranks::ByteView> to(static_cast<std::size_t>(this->size()));
  for (std::size_t r = 0; is_first() && r < to.size(); ++r) {
    const std::uint64_t first = soup_.lattice_at(soup_.ranges[r].first), last = soup_.lattice_at(soup_.ranges[r].last);
    to[r] = all.subspan(first * size, (last - first) * size);
  }
  return std::move(ranks_.exchange(to)[0]);
}

std::vector<float> SharedSoup::own_values(const gpu::Buffer& pool) {
  const TriangleRange own = soup_.own();
  const std::uint64_t count = (soup_.source_at(own.last) - soup_.source_at(own.first)) * soup::kChannels;
  return count > 0 ? gpu_.download_vector<float>(pool.address(), count) : std::vector<float>{};
}

std::vector<float> SharedSoup::all_values(const gpu::Buffer& pool) {
  return ranks::values_of<float>(all_gather(ranks::bytes_of(own_values(pool))));
}
std::vector<float> SharedSoup::gather_values(const gpu::Buffer& pool) {
  return ranks::values_of<float>(gather_on_first(ranks::bytes_of(own_values(pool))));
}

void SharedSoup::compare() {
  std::uint64_t hash = 0xcbf29ce484222325u;  // FNV-1a
  const auto add = [&](const gpu::Buffer& buffer, std::uint64_t words) {
    for (const std::uint32_t word : gpu_.download_vector<std::uint32_t>(buffer.address(), words))
      hash = (hash ^ word) * 0x100000001b3u;
  };
  add(soup_.vertices, 9ull * soup_.triangles);
  add(soup_.mlp, kMlp);
  const std::vector<ranks::Bytes> all = ranks_.all_gather(ranks::bytes_of(std::vector{hash}));
  for (std::size_t r = 1; r < all.size(); ++r)
    if (all[r] != all[0])
      throw Error(
          "rank {} of {}: its vertices or MLP differ from those of rank 0; use devices of the same model and driver on "
          "all ranks",
          r, all.size());
}

}  // namespace trisoup::train
