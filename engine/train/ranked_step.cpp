#include "train/ranked_step.h"

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

/// What every message of the first exchange begins with.
enum Flag : std::uint32_t { kOverflow = 1, kStop = 2 };

/// The order that visibility.comp keeps within one rank: the nearest, and of equals the lower number. Both of a triangle.
bool wins(const Hit& a, const Hit& b) { return a.depth < b.depth || (a.depth == b.depth && a.triangle < b.triangle); }

/// Pixels that `rank` finds the winners of.
std::pair<std::size_t, std::size_t> slice_of(std::size_t pixels, int rank, int ranks) {
  return {pixels * static_cast<std::size_t>(rank) / static_cast<std::size_t>(ranks), pixels * (static_cast<std::size_t>(rank) + 1) / static_cast<std::size_t>(ranks)};
}

template <typename T>
void append(ranks::Bytes& to, std::span<const T> values) {
  const auto bytes = std::as_bytes(values);
  to.insert(to.end(), bytes.begin(), bytes.end());
}

std::vector<ranks::ByteView> views_of(const std::vector<ranks::Bytes>& messages) { return {messages.begin(), messages.end()}; }

/// Values of a message, one group after the other. The sender and this rank have found what comes from the same pictures, so that
/// a message which ends early is another build's.
class Reader {
 public:
  explicit Reader(ranks::ByteView bytes) : bytes_(bytes) {}
  void take(std::span<float> values) {
    if (bytes_.size() < values.size_bytes()) throw Error("ranks: a message is too short; all ranks have to run the same build");
    std::memcpy(values.data(), bytes_.data(), values.size_bytes());
    bytes_ = bytes_.subspan(values.size_bytes());
  }

 private:
  ranks::ByteView bytes_;
};

}  // namespace

std::vector<TriangleRange> divided(std::span<const soup::TextureEntry> table, int ranks) {
  // Logits and moments in floats, and what a triangle has besides them.
  constexpr std::uint64_t kBesides = 8;
  const auto size_of = [&](const soup::TextureEntry& row) { return kBesides + soup::samples_in(row.level_min, row.level_max); };
  std::uint64_t total = 0, so_far = 0;
  for (const soup::TextureEntry& row : table) total += size_of(row);
  std::vector<TriangleRange> ranges;
  std::uint32_t t = 0;
  for (int r = 1; r <= ranks; ++r) {
    const std::uint32_t first = t;
    const std::uint64_t until = total * static_cast<std::uint64_t>(r) / static_cast<std::uint64_t>(ranks);
    while (t < table.size() && (r == ranks || so_far + size_of(table[t]) / 2 < until)) so_far += size_of(table[t++]);
    ranges.push_back({first, t});
  }
  return ranges;
}

std::vector<std::uint16_t> shaders_of(const BatchLayout& batch, std::uint32_t groups, int ranks) {
  constexpr std::uint32_t kBlock = 16;
  std::vector<std::uint16_t> shaders(batch.pixels);
  for (const kernels::ViewRecord& view : batch.records) {
    const std::uint32_t blocks_x = (view.width + kBlock - 1) / kBlock;
    for (std::uint32_t y = 0; y < view.height; ++y)
      for (std::uint32_t x = 0; x < view.width; ++x) {
        const std::uint32_t block = view.block_offset + y / kBlock * blocks_x + x / kBlock;
        shaders[view.pixel_offset + std::size_t(y) * view.width + x] = static_cast<std::uint16_t>(block % groups % static_cast<std::uint32_t>(ranks));
      }
  }
  return shaders;
}

template <typename Visit>
void RankedStep::each_pixel(Visit&& visit) const {
  for (std::size_t p = 0; p < hits_.size(); ++p)
    if (hits_[p].triangle != 0) visit(p, owners_[hits_[p].triangle - 1], shaders_[p]);
}

void RankedStep::grow(gpu::Buffer& buffer, std::uint64_t bytes, const char* what) {
  if (bytes <= buffer.bytes()) return;
  buffer = {};
  buffer = gpu_.allocate(bytes, what);
  gpu_.fill(buffer.address(), bytes, 0);
}

void RankedStep::divide_if_needed() {
  if (!ranges_.empty()) return;
  ranges_ = divided(soup_.table, ranks_.size());
  owners_.clear();
  for (std::size_t r = 0; r < ranges_.size(); ++r) owners_.insert(owners_.end(), ranges_[r].count(), static_cast<std::uint16_t>(r));
}

void RankedStep::place_batch() {
  const BatchLayout& batch = frame_.batch();
  const std::uint64_t pixels = batch.pixels;
  std::vector<std::uint64_t> sizes{frame_.mlp_groups};
  for (const kernels::ViewRecord& view : batch.records) sizes.push_back(std::uint64_t(view.width) << 32 | view.height);
  if (sizes != shaders_for_) {
    shaders_ = shaders_of(batch, frame_.mlp_groups, ranks_.size());
    shaders_for_ = std::move(sizes);
  }
  hits_.resize(pixels);
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

ShadedFrom RankedStep::stand_in() const {
  // A fragment at barycentrics 0, 0 of a texture of level 0 is that texture's first sample, the other two having no weight.
  return {hits_here_.address(), textures_here_.address(), features_.address(), places_.address(), zeroes_.address(), gradient_.address()};
}

RankedStep::Outcome RankedStep::agree_on_winners(bool stop) {
  const int ranks = ranks_.size();
  const auto control = gpu_.download_vector<kernels::Control>(frame_.control.address(), 1)[0];
  const std::uint32_t flags = (control.overflow != 0 ? kOverflow : 0u) | (stop ? kStop : 0u);
  gpu_.download(frame_.hits.address(), std::as_writable_bytes(std::span(hits_)));
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
  for (const ranks::Bytes& message : received) all_flags |= ranks::values_of<std::uint32_t>(ranks::ByteView(message).first(4))[0];
  if (all_flags & kStop) return Outcome::stopped;
  if (all_flags & kOverflow) return Outcome::overflow;

  const auto [first, last] = slice_of(hits_.size(), ranks_.rank(), ranks);
  std::vector<Hit> winners(last - first);
  for (const ranks::Bytes& message : received)
    for (const Candidate& c : ranks::values_of<Candidate>(ranks::ByteView(message).subspan(4))) {
      if (c.pixel < first || c.pixel >= last) throw Error("ranks: a message is about other pixels; all ranks have to run the same build");
      Hit& winner = winners[c.pixel - first];
      if (winner.triangle == 0 || wins(c.hit, winner)) winner = c.hit;
    }
  const std::vector<ranks::Bytes> slices = ranks_.gather(ranks::bytes_of(winners));
  auto to = std::as_writable_bytes(std::span(hits_)).begin();
  for (const ranks::Bytes& slice : slices) to = std::copy(slice.begin(), slice.end(), to);
  gpu_.upload(frame_.hits.address(), hits_);
  return Outcome::done;
}

void RankedStep::send_features() {
  const auto pixels = static_cast<std::uint32_t>(hits_.size());
  const auto self = static_cast<std::uint16_t>(ranks_.rank());
  gpu_.launch({"fetch_features"}, (pixels + 63) / 64,
              kernels::FetchFeaturesArgs{frame_.hits.address(), soup_.textures.address(), soup_.lattice.address(), features_.address(), pixels,
                                         own().first, own().last, 0});
  features_here_.resize((pixels + 2) * kFeatureStride);
  gpu_.download(features_.address(), std::as_writable_bytes(std::span(features_here_)));
  std::vector<ranks::Bytes> messages(static_cast<std::size_t>(ranks_.size()));
  each_pixel([&](std::size_t p, std::uint16_t owner, std::uint16_t shader) {
    if (owner == self && shader != self) append<float>(messages[shader], {&features_here_[p * kFeatureStride], kFeatures});
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
}

void RankedStep::send_colours() {
  const auto self = static_cast<std::uint16_t>(ranks_.rank());
  // Where nothing is visible it is the background for everybody.
  auto colours = gpu_.download_vector<float>(frame_.colour.address(), 3 * hits_.size());
  ranks::Bytes mine;
  each_pixel([&](std::size_t p, std::uint16_t, std::uint16_t shader) {
    if (shader == self) append<float>(mine, {&colours[3 * p], 3});
  });
  const std::vector<ranks::Bytes> received = ranks_.gather(mine);
  std::vector<Reader> readers(received.begin(), received.end());
  each_pixel([&](std::size_t p, std::uint16_t, std::uint16_t shader) { readers[shader].take({&colours[3 * p], 3}); });
  gpu_.upload(frame_.colour.address(), colours);
}

void RankedStep::send_gradients() {
  const std::size_t pixels = hits_.size(), ranks = static_cast<std::size_t>(ranks_.size()), groups = frame_.mlp_groups;
  const auto self = static_cast<std::uint16_t>(ranks_.rank());
  auto gradient = gpu_.download_vector<float>(gradient_.address(), kFeatures * pixels);
  auto sums = gpu_.download_vector<float>(frame_.mlp_partial.address(), groups * kMlp);
  const auto each_group_of = [&](std::size_t rank, const auto& visit) {
    for (std::size_t g = rank; g < groups; g += ranks) visit(std::span(sums).subspan(g * kMlp, kMlp));
  };
  std::vector<ranks::Bytes> messages(ranks);
  for (ranks::Bytes& message : messages) each_group_of(self, [&](std::span<float> row) { append<float>(message, row); });
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
  gpu_.upload(frame_.mlp_partial.address(), sums);
  gpu_.upload(gradient_.address(), gradient);
}

RankedStep::Outcome RankedStep::train(const StepInputs& inputs, bool stop) {
  divide_if_needed();
  place_batch();
  Step step(gpu_, soup_, frame_, own());
  step.visibility(inputs.opaque ? Thresholds::half : Thresholds::random, inputs);
  if (const Outcome outcome = agree_on_winners(stop); outcome != Outcome::done) return outcome;
  textures_sent_ = moments_sent_ = false;
  send_features();
  step.shade(inputs, stand_in());
  send_colours();
  step.loss(inputs);
  step.sort_pixels();
  step.shade_backward(inputs, stand_in());
  send_gradients();
  const auto pixels = static_cast<std::uint32_t>(hits_.size());
  gpu_.launch({"sort_gradients"}, (pixels + 63) / 64,
              kernels::SortGradientsArgs{frame_.hits.address(), frame_.shown.address() + 4 * (soup_.triangles + 1ull), frame_.ranks.address(),
                                         gradient_.address(), frame_.sorted(), pixels, own().first, own().last, 0});
  step.edge_forces();
  if (!inputs.opaque) step.opacity_backward(inputs);
  step.update(inputs);
  return Outcome::done;
}

void RankedStep::gather(gpu::Buffer& buffer) {
  // A triangle's samples follow those of the one before it.
  const auto sample_of = [&](std::uint32_t t) { return t < soup_.triangles ? soup_.table[t].source_offset : soup_.source_samples; };
  constexpr std::uint64_t kBytes = soup::kChannels * 4;  // of a sample
  const auto bytes_of = [&](TriangleRange range) { return kBytes * (sample_of(range.last) - sample_of(range.first)); };
  ranks::Bytes mine(bytes_of(own()));
  if (!mine.empty()) gpu_.download(buffer.address() + kBytes * sample_of(own().first), mine);
  const std::vector<ranks::Bytes> received = ranks_.gather(mine);
  for (std::size_t r = 0; r < received.size(); ++r) {
    if (received[r].size() != bytes_of(ranges_[r])) throw Error("ranks: a message is of other textures; all ranks have to run the same build");
    if (static_cast<int>(r) != ranks_.rank() && !received[r].empty())
      gpu_.upload(buffer.address() + kBytes * sample_of(ranges_[r].first), received[r]);
  }
}

void RankedStep::compare() {
  std::uint64_t hash = 0xcbf29ce484222325u;  // FNV-1a
  const auto add = [&](const gpu::Buffer& buffer, std::uint64_t words) {
    for (const std::uint32_t word : gpu_.download_vector<std::uint32_t>(buffer.address(), words)) hash = (hash ^ word) * 0x100000001b3u;
  };
  add(soup_.vertices, 9ull * soup_.triangles);
  add(soup_.mlp, kMlp);
  const std::vector<ranks::Bytes> all = ranks_.gather(ranks::bytes_of(std::vector{hash}));
  for (std::size_t r = 1; r < all.size(); ++r)
    if (all[r] != all[0])
      throw Error("rank {} of {}: its vertices or MLP are no longer those of rank 0; all ranks need devices of one kind, with the same driver", r, all.size());
}

void RankedStep::gather(bool moments) {
  if (ranges_.empty()) return;  // no step since they were divided
  if (!textures_sent_) {
    compare();
    gather(soup_.source);
    Step(gpu_, soup_, frame_).sum_textures();
    textures_sent_ = true;
  }
  if (moments && !moments_sent_) {
    gather(soup_.source_moment1);
    gather(soup_.source_moment2);
    moments_sent_ = true;
  }
}

}  // namespace trisoup::train
