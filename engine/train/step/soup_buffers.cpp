#include "train/step/soup_buffers.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "args/types.h"
#include "common/host.h"
#include "soup/random.h"
#include "train/step/fixed_sum.h"
#include "train/step/shared_soup.h"

namespace trisoup::train {
namespace {

/// Writes features that show the corners' colours, interpolated at sample `i` of a level. The weight of the MLP's
/// colour is small but large enough to have a gradient.
void write_colour(float* sample, std::span<const glm::vec3> corners, std::uint32_t i, std::uint32_t level) {
  constexpr float kMlpShare = -1.0f;  // weight of the MLP's colour, a logit
  std::uint32_t x = 0, y = 0;
  f32::lattice_point(i, x, y);
  const float r = static_cast<float>(1u << level), b0 = static_cast<float>(x) / r, b1 = static_cast<float>(y) / r;
  const glm::vec3 colour = glm::clamp(b0 * corners[0] + b1 * corners[1] + (1.0f - b0 - b1) * corners[2], 0.02f, 0.98f);
  for (int c = 0; c < 3; ++c) sample[c] = std::log(colour[c] / (1.0f - colour[c]));
  sample[3] = kMlpShare;
}

}  // namespace

TriangleRange SoupBuffers::own() const { return ranges[static_cast<std::size_t>(partition->rank())]; }

std::uint64_t soup_bytes(std::uint64_t triangles, std::uint32_t level_min, std::uint32_t level_max,
                         std::uint32_t ranks) {
  return triangle_bytes(triangles) +
         triangles * texture_bytes(soup::samples_in(level_min, level_max), soup::samples_at(level_max)) / ranks;
}

void make_opaque(gpu::Device& gpu, SoupBuffers& soup) {
  gpu.fill(soup.opacity.address(), soup.opacity.bytes(), std::bit_cast<std::uint32_t>(1.0f));
}

void clear(gpu::Device& gpu, const FixedSums& sums) {
  gpu.fill(sums.low.address(), sums.low.bytes(), kFixedZero);
  gpu.fill(sums.high.address(), sums.high.bytes(), 0);
}

std::uint64_t source_samples(std::span<const soup::TextureEntry> table) {
  std::uint64_t samples = 0;
  for (const soup::TextureEntry& row : table)
    samples = std::max<std::uint64_t>(
        samples, std::uint64_t(row.source_offset) + soup::samples_in(row.level_min, row.level_max));
  return samples;
}

std::vector<soup::TextureEntry> local_rows(std::span<const soup::TextureEntry> table, TriangleRange own) {
  std::vector<soup::TextureEntry> rows(table.begin(), table.end());
  for (std::uint32_t t = 0; t < rows.size(); ++t) {
    const bool here = t >= own.first && t < own.last;
    rows[t].source_offset = here ? rows[t].source_offset - table[own.first].source_offset : 0;
    rows[t].lattice_offset = here ? rows[t].lattice_offset - table[own.first].lattice_offset : 0;
  }
  return rows;
}

gpu::Buffer upload_logits(gpu::Device& gpu, std::span<const soup::TextureEntry> table, TriangleRange own,
                          const std::function<void(std::size_t, float*)>& write) {
  const auto at = [&](std::uint32_t t) { return t < table.size() ? table[t].source_offset : source_samples(table); };
  const std::uint64_t begins = at(own.first), bytes = (at(own.last) - begins) * soup::kChannels * 4;
  gpu::Buffer logits = gpu.allocate(bytes, "textures");
  // Upload many triangles at once.
  std::vector<float> piece;
  std::uint64_t first = 0;
  const auto upload = [&] {
    if (!piece.empty()) gpu.upload(logits.address() + (first - begins) * soup::kChannels * 4, piece);
    piece.clear();
  };
  for (std::size_t t = own.first; t < own.last; ++t) {
    const soup::TextureEntry& row = table[t];
    if (piece.size() > (1u << 20)) upload();
    if (piece.empty()) first = row.source_offset;
    const std::size_t begin = (row.source_offset - first) * soup::kChannels;
    piece.resize(begin + std::size_t(soup::samples_in(row.level_min, row.level_max)) * soup::kChannels);
    write(t, &piece[begin]);
  }
  upload();
  return logits;
}

gpu::Buffer initial_logits(gpu::Device& gpu, std::span<const soup::TextureEntry> table,
                           std::span<const glm::vec3> colours, std::span<const float> opacities, TriangleRange own) {
  own.last = std::min(own.last, all_of(table).last);
  // Finer levels than the coarsest stay zero.
  return upload_logits(gpu, table, own, [&](std::size_t t, float* sample) {
    for (std::uint32_t i = 0; i < soup::samples_at(table[t].level_min); ++i, sample += soup::kChannels) {
      sample[soup::kChannels - 1] = opacities[t];
      if (!colours.empty()) write_colour(sample, colours.subspan(3 * t, 3), i, table[t].level_min);
    }
  });
}

namespace {

/// Fills SoupBuffers::tasks and classes.
void sort_by_size(gpu::Device& gpu, SoupBuffers& soup) {
  // Numbers of samples of levels 2..2, 2..3, 2..4 and 0..5.
  constexpr std::array<std::uint32_t, 4> kMost{15, 60, 213, 783};
  const TriangleRange own = soup.own();
  const std::vector<soup::TextureEntry> rows = local_rows(soup.table, own);
  std::array<std::vector<kernels::TextureTask>, kMost.size()> tasks;
  for (std::uint32_t t = own.first; t < own.last; ++t) {
    const soup::TextureEntry& row = rows[t];
    const auto fits = std::lower_bound(kMost.begin(), kMost.end(), soup::samples_in(row.level_min, row.level_max));
    tasks[static_cast<std::size_t>(fits - kMost.begin())].push_back(
        {row.source_offset, row.lattice_offset, row.level_min | row.level_max << 8, t - own.first});
  }
  std::vector<kernels::TextureTask> sorted;
  soup.classes.clear();
  for (std::size_t c = 0; c < kMost.size(); ++c) {
    if (!tasks[c].empty())
      soup.classes.push_back(
          {static_cast<std::uint32_t>(sorted.size()), static_cast<std::uint32_t>(tasks[c].size()), kMost[c]});
    sorted.insert(sorted.end(), tasks[c].begin(), tasks[c].end());
  }
  soup.tasks = gpu.allocate(sorted.size() * sizeof(kernels::TextureTask), "texture table");
  gpu.upload(soup.tasks.address(), sorted);
}

}  // namespace

void allocate_soup(gpu::Device& gpu, SoupBuffers& soup, std::span<const glm::vec3> vertices,
                   std::vector<soup::TextureEntry> table, Textures textures) {
  soup.triangles = static_cast<std::uint32_t>(table.size());
  soup.source_samples = source_samples(table);
  soup.lattice_samples = 0;
  soup.level_max = 0;
  for (const soup::TextureEntry& entry : table) {
    soup.lattice_samples = std::max<std::uint64_t>(
        soup.lattice_samples, std::uint64_t(entry.lattice_offset) + soup::samples_at(entry.level_max));
    soup.level_max = std::max(soup.level_max, entry.level_max);
  }
  soup.table = std::move(table);
  soup.ranges = divided(soup.table, soup.partition->size());
  const TriangleRange own = soup.own();
  const std::uint64_t sources = soup.source_at(own.last) - soup.source_at(own.first);
  const std::uint64_t lattices = soup.lattice_at(own.last) - soup.lattice_at(own.first);

  const auto zeroed = [&](std::uint64_t bytes, const char* what) {
    gpu::Buffer buffer = gpu.allocate(bytes, what);
    gpu.fill(buffer.address(), buffer.bytes(), 0);
    return buffer;
  };
  const auto sums = [&](std::uint64_t count, const char* what) {
    FixedSums s{gpu.allocate(count * 4, what), gpu.allocate(count * 4, what)};
    clear(gpu, s);
    return s;
  };
  const std::uint64_t vertex_count = 3ull * soup.triangles;
  soup.vertices = gpu.allocate(vertex_count * 12, "vertices");
  gpu.upload(soup.vertices.address(), std::as_bytes(vertices));
  soup.vertex_moment1 = zeroed(vertex_count * 12, "vertex moments");
  soup.vertex_moment2 = zeroed(vertex_count * 4, "vertex moments");
  soup.vertex_gradient = sums(vertex_count * 3, "vertex gradients");
  soup.textures = gpu.allocate(soup.triangles * sizeof(soup::TextureEntry), "texture table");
  gpu.upload(soup.textures.address(), local_rows(soup.table, own));
  sort_by_size(gpu, soup);
  const auto given = [&](gpu::Buffer& buffer, const char* what) {
    return buffer ? std::move(buffer) : zeroed(sources * 32, what);
  };
  soup.source = given(textures.source, "textures");
  soup.source_moment1 = given(textures.moment1, "texture moments");
  soup.source_moment2 = given(textures.moment2, "texture moments");
  soup.lattice = gpu.allocate(lattices * 32, "summed textures");
  soup.opacity = gpu.allocate(lattices * 4, "opacities");
  soup.opacity_gradient = sums(lattices, "opacity gradients");
  soup.touched = zeroed(soup.triangles * 4ull, "opacity gradients");
}

soup::Mlp initial_mlp(std::uint64_t seed) {
  constexpr std::uint64_t kStream = 0x6d6c70;  // "mlp"
  soup::Random random(seed, kStream);
  soup::Mlp mlp;
  const auto uniform = [&](int first, int count, double bound) {
    for (int i = first; i < first + count; ++i)
      mlp.parameters[i] = static_cast<float>((2.0 * random.uniform01() - 1.0) * bound);
  };
  uniform(0, 256, std::sqrt(6.0 / 16));         // w1: He
  uniform(272, 256, std::sqrt(6.0 / 16));       // w2: He
  uniform(544, 48, std::sqrt(6.0 / (16 + 3)));  // w3: Xavier
  return mlp;
}

void allocate_mlp(gpu::Device& gpu, SoupBuffers& soup, const soup::Mlp& mlp) {
  const std::uint64_t bytes = soup::Mlp::kParameters * 4;
  soup.mlp = gpu.allocate(bytes, "MLP");
  soup.mlp_moment1 = gpu.allocate(bytes, "MLP moments");
  soup.mlp_moment2 = gpu.allocate(bytes, "MLP moments");
  gpu.upload(soup.mlp.address(), mlp.parameters);
  gpu.fill(soup.mlp_moment1.address(), soup.mlp_moment1.bytes(), 0);
  gpu.fill(soup.mlp_moment2.address(), soup.mlp_moment2.bytes(), 0);
}

}  // namespace trisoup::train
