#include "train/topology/unseen_textures.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "base/parallel_for.h"
#include "common/host.h"
#include "mesh/scattered_means.h"
#include "ranks/ranks.h"
#include "train/start/painting.h"
#include "train/step/fixed_sum.h"
#include "train/step/step.h"

namespace trisoup::train {
namespace {

using soup::ScatteredMeans;
constexpr std::size_t kWords = soup::kChannels;

glm::vec3 sample_position(const glm::vec3* corners, std::uint32_t sample, std::uint32_t level) {
  std::uint32_t x = 0, y = 0;
  f32::lattice_point(sample, x, y);
  const float r = static_cast<float>(1u << level), b0 = static_cast<float>(x) / r, b1 = static_cast<float>(y) / r;
  return b0 * corners[0] + b1 * corners[1] + (1.0f - b0 - b1) * corners[2];
}

/// The samples of a texture that pixels show. Of a texture without unseen ones, those of level 2 are enough.
std::vector<std::uint32_t> seen_samples(std::span<const float> pixels, std::uint32_t level) {
  const bool whole = std::all_of(pixels.begin(), pixels.end(), [](float p) { return p > 0; });
  const std::uint32_t step = whole && level > 2 ? 1u << (level - 2) : 1u;
  std::vector<std::uint32_t> seen;
  for (std::uint32_t i = 0; i < pixels.size(); ++i) {
    std::uint32_t x = 0, y = 0;
    f32::lattice_point(i, x, y);
    if (pixels[i] > 0 && x % step == 0 && y % step == 0) seen.push_back(i);
  }
  return seen;
}

/// All seen samples. A triangle's have its area together, or the part of it that is seen.
std::vector<ScatteredMeans::Point> seen_points(std::span<const glm::vec3> vertices,
                                               std::span<const soup::TextureEntry> table,
                                               std::span<const float> lattice, std::span<const float> pixels) {
  std::vector<ScatteredMeans::Point> points;
  for (std::size_t t = 0; t < table.size(); ++t) {
    const soup::TextureEntry& row = table[t];
    const glm::vec3* corners = &vertices[3 * t];
    const auto own = pixels.subspan(row.lattice_offset, soup::samples_at(row.level_max));
    const float area = 0.5f * glm::length(glm::cross(corners[1] - corners[0], corners[2] - corners[0]));
    const auto shown = static_cast<float>(std::count_if(own.begin(), own.end(), [](float p) { return p > 0; }));
    const std::vector<std::uint32_t> samples = seen_samples(own, row.level_max);
    const float weight = area * shown / static_cast<float>(own.size() * std::max<std::size_t>(samples.size(), 1));
    if (!(weight > 0)) continue;
    for (const std::uint32_t i : samples) {
      points.push_back({sample_position(corners, i, row.level_max), weight, {}});
      std::copy_n(&lattice[kWords * (row.lattice_offset + i)], points.back().values.size(),
                  points.back().values.begin());
    }
  }
  return points;
}

float median_spacing(std::span<const ScatteredMeans::Point> points) {
  std::vector<float> weights;
  for (const ScatteredMeans::Point& p : points) weights.push_back(p.weight);
  const auto middle = weights.begin() + static_cast<std::ptrdiff_t>(weights.size() / 2);
  std::nth_element(weights.begin(), middle, weights.end());
  return std::sqrt(*middle);
}

/// [lattice samples] of own triangles.
std::vector<float> pixels_of_samples(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers,
                                     std::span<const BatchView> views) {
  const FixedSums sums = sum_photographs(gpu, soup, buffers, views, soup.table, soup.own(), nullptr);
  const std::uint64_t samples = soup.lattice_at(soup.own().last) - soup.lattice_at(soup.own().first);
  std::vector<float> pixels(samples);
  if (samples == 0) return pixels;
  const auto low = gpu.download_vector<std::uint32_t>(sums.low.address(), 4 * samples);
  const auto high = gpu.download_vector<std::uint32_t>(sums.high.address(), 4 * samples);
  for (std::size_t i = 0; i < pixels.size(); ++i)
    pixels[i] = static_cast<float>(fixed_sum(low[4 * i + 3], high[4 * i + 3]));
  return pixels;
}

/// Sum of a texture's levels below the finest, at sample `i` of the finest. source: all levels.
float coarser_levels(const float* source, const soup::TextureEntry& row, std::uint32_t i, std::size_t channel) {
  std::uint32_t x = 0, y = 0;
  f32::lattice_point(i, x, y);
  const float r = static_cast<float>(1u << row.level_max);
  float sum = 0;
  for (std::uint32_t level = row.level_min; level < row.level_max; ++level) {
    const f32::LatticeCell cell = f32::lattice_cell(static_cast<float>(x) / r, static_cast<float>(y) / r, level);
    const auto value = [&](std::uint32_t sample) { return source[kWords * sample + channel]; };
    sum += f32::lattice_mix(cell, value(cell.i0), value(cell.i1), value(cell.i2));
    source += kWords * soup::samples_at(level);
  }
  return sum;
}

/// Changes the finest level of a texture so that its unseen samples become `values`, [samples][8], except for their
/// opacities. source: all levels.
void write_unseen(float* source, const soup::TextureEntry& row, const float* values, const float* pixels) {
  const std::uint32_t samples = soup::samples_at(row.level_max);
  float* finest = source + kWords * (soup::samples_in(row.level_min, row.level_max) - samples);
  for (std::uint32_t i = 0; i < samples; ++i)
    for (std::size_t c = 0; pixels[i] <= 0 && c < ScatteredMeans::kChannels; ++c) {
      const float p = std::clamp(values[kWords * i + c], 1e-4f, 1.0f - 1e-4f);
      finest[kWords * i + c] = std::log(p / (1.0f - p)) - coarser_levels(source, row, i, c);
    }
}

/// The same for all own triangles. values, pixels: of their lattice samples.
void write_unseen(gpu::Device& gpu, SoupBuffers& soup, std::span<const float> values, std::span<const float> pixels) {
  constexpr std::uint32_t kPart = 1024;  // triangles whose textures are copied at once
  const TriangleRange own = soup.own();
  for (std::uint32_t first = own.first; first < own.last; first += kPart) {
    const std::uint32_t last = std::min(first + kPart, own.last);
    const std::uint64_t begin = soup.source_at(first);
    const gpu::Address at = soup.source.address() + 4 * kWords * (begin - soup.source_at(own.first));
    auto source = gpu.download_vector<float>(at, kWords * (soup.source_at(last) - begin));
    for (std::uint32_t t = first; t < last; ++t) {
      const std::uint64_t lattice = soup.lattice_at(t) - soup.lattice_at(own.first);
      write_unseen(&source[kWords * (soup.source_at(t) - begin)], soup.table[t], &values[kWords * lattice],
                   &pixels[lattice]);
    }
    gpu.upload(at, source);
  }
}

}  // namespace

std::vector<float> fill_unseen(std::span<const glm::vec3> vertices, std::span<const soup::TextureEntry> table,
                               std::vector<float> lattice, std::span<const float> pixels) {
  const std::vector<ScatteredMeans::Point> seen = seen_points(vertices, table, lattice, pixels);
  if (seen.empty()) return lattice;
  const ScatteredMeans means(seen, median_spacing(seen));
  parallel_for(static_cast<int>(table.size()), 0, [&](int t) {
    const soup::TextureEntry& row = table[static_cast<std::size_t>(t)];
    for (std::uint32_t i = 0; i < soup::samples_at(row.level_max); ++i) {
      const std::size_t at = row.lattice_offset + i;
      if (pixels[at] > 0) continue;
      const auto mean = means.at(sample_position(&vertices[3 * static_cast<std::size_t>(t)], i, row.level_max));
      std::copy(mean.begin(), mean.end(), &lattice[kWords * at]);
    }
  });
  return lattice;
}

void fill_unseen(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers, std::span<const BatchView> views) {
  const std::vector<float> pixels = pixels_of_samples(gpu, soup, buffers, views);
  SoupPartition& ranks = *soup.partition;
  const auto gathered = [&](const std::vector<float>& mine) {
    return ranks::values_of<float>(ranks.gather_on_first(ranks::bytes_of(mine)));
  };
  std::vector<float> lattice(kWords * pixels.size());
  if (!lattice.empty()) lattice = gpu.download_vector<float>(soup.lattice.address(), lattice.size());
  std::vector<float> all = gathered(lattice);
  const std::vector<float> all_pixels = gathered(pixels);
  if (ranks.is_first())
    all = fill_unseen(gpu.download_vector<glm::vec3>(soup.vertices.address(), 3ull * soup.triangles), soup.table,
                      std::move(all), all_pixels);
  const auto values = ranks::values_of<float>(ranks.scatter_from_first(ranks::bytes_of(all), kWords * sizeof(float)));
  write_unseen(gpu, soup, values, pixels);
  Step(gpu, soup, buffers).sum_textures();
}

}  // namespace trisoup::train
