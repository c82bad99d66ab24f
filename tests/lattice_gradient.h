// Gradients of textures on the finest lattice: what update_textures sums up, for tests to look at and to set.
#pragma once

#include <cmath>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "common/host.h"
#include "gpu/device.h"
#include "soup/soup.h"
#include "train/step/batch_buffers.h"
#include "train/step/fixed_sum.h"
#include "train/step/soup_buffers.h"

namespace trisoup::test {

/// [lattice samples][8] in 2^-44: sums of the features' over the sorted pixels, in any order; opacities' as the device
/// has them.
inline std::vector<std::int64_t> lattice_quanta(gpu::Device& gpu, const train::SoupBuffers& soup,
                                                const train::BatchBuffers& buffers) {
  const std::size_t pixels = buffers.batch().pixels;
  const auto shown = gpu.download_vector<std::uint32_t>(buffers.shown.address(), 2ull * soup.triangles + 1);
  const auto sorted = gpu.download_vector<float>(buffers.sorted(), 9 * pixels);
  std::vector<std::int64_t> quanta(soup.lattice_samples * 8, 0);
  for (std::size_t t = 0; t < soup.triangles; ++t)
    for (std::size_t at = shown[soup.triangles + 1 + t], end = at + shown[t]; at < end; ++at) {
      const f32::LatticeCell cell =
          f32::lattice_cell(sorted[7 * pixels + at], sorted[8 * pixels + at], soup.table[t].level_max);
      for (const auto& [sample, weight] : {std::pair(cell.i0, cell.w0), {cell.i1, cell.w1}, {cell.i2, cell.w2}})
        for (std::size_t c = 0; c < 7; ++c)
          quanta[(soup.table[t].lattice_offset + sample) * 8 + c] +=
              std::llround(double(weight * sorted[c * pixels + at]) * 0x1p44);
    }
  const auto low = gpu.download_vector<std::uint32_t>(soup.opacity_gradient.low.address(), soup.lattice_samples);
  const auto high = gpu.download_vector<std::uint32_t>(soup.opacity_gradient.high.address(), soup.lattice_samples);
  for (std::size_t i = 0; i < low.size(); ++i)
    quanta[8 * i + 7] = static_cast<std::int64_t>((std::uint64_t(high[i]) << 32 | low[i]) - 0x80000000ull);
  return quanta;
}

inline std::vector<double> lattice_gradient(gpu::Device& gpu, const train::SoupBuffers& soup,
                                            const train::BatchBuffers& buffers) {
  const std::vector<std::int64_t> quanta = lattice_quanta(gpu, soup, buffers);
  std::vector<double> gradient;
  for (const std::int64_t q : quanta) gradient.push_back(static_cast<double>(q) * 0x1p-44);
  return gradient;
}

/// Leaves a gradient, [lattice samples][8], for an update: a pixel for each sample of each texture, all in a frame that
/// has so many.
inline void set_lattice_gradient(gpu::Device& gpu, const train::SoupBuffers& soup, const train::BatchBuffers& buffers,
                                 std::span<const double> gradient) {
  const std::size_t pixels = buffers.batch().pixels;
  std::vector<std::uint32_t> shown(2ull * soup.triangles + 1), low, high;
  std::vector<float> sorted(9 * pixels);
  std::size_t at = 0;
  for (std::size_t t = 0; t < soup.triangles; ++t) {
    const soup::TextureEntry& row = soup.table[t];
    shown[t] = soup::samples_at(row.level_max);
    shown[soup.triangles + 1 + t] = static_cast<std::uint32_t>(at);
    for (std::uint32_t i = 0; i < shown[t]; ++i, ++at) {
      std::uint32_t x = 0, y = 0;
      f32::lattice_point(i, x, y);
      for (std::size_t c = 0; c < 7; ++c)
        sorted.at(c * pixels + at) = static_cast<float>(gradient[(row.lattice_offset + i) * 8ull + c]);
      sorted.at(7 * pixels + at) = static_cast<float>(x) / static_cast<float>(1u << row.level_max);
      sorted.at(8 * pixels + at) = static_cast<float>(y) / static_cast<float>(1u << row.level_max);
    }
  }
  for (std::size_t i = 7; i < gradient.size(); i += 8) {
    const std::uint64_t words = static_cast<std::uint64_t>(std::llround(gradient[i] * 0x1p44)) + 0x80000000ull;
    low.push_back(static_cast<std::uint32_t>(words));
    high.push_back(static_cast<std::uint32_t>(words >> 32));
  }
  gpu.upload(buffers.shown.address(), shown);
  gpu.upload(buffers.sorted(), sorted);
  gpu.upload(soup.opacity_gradient.low.address(), low);
  gpu.upload(soup.opacity_gradient.high.address(), high);
}

}  // namespace trisoup::test
