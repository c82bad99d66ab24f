#include "train/paint.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/host.h"
#include "train/render_pass.h"
#include "train/shared_soup.h"

namespace trisoup::train {
namespace {

/// A sample's coarser level counts as much as so many pixels.
constexpr float kPrior = 0.5f;
/// The share of the MLP, a logit: little, since the mean over the views is a good guess, but enough to grow from.
constexpr float kMlpShare = -3.0f;
/// So many pixels of all photographs together say enough.
constexpr std::uint64_t kMostPixels = 1u << 26;

float logit_of(float colour) {
  const float c = std::clamp(colour, 0.02f, 0.98f);
  return std::log(c / (1.0f - c));
}

glm::vec3 mix(const f32::LatticeCell& cell, std::span<const glm::vec3> samples) {
  return cell.w0 * samples[cell.i0] + cell.w1 * samples[cell.i1] + cell.w2 * samples[cell.i2];
}

/// Where sample `i` of level `of` lies in level `in`.
f32::LatticeCell cell_of_sample(std::uint32_t i, std::uint32_t of, std::uint32_t in) {
  std::uint32_t x = 0, y = 0;
  f32::lattice_point(i, x, y);
  const float r = static_cast<float>(1u << of);
  return f32::lattice_cell(static_cast<float>(x) / r, static_cast<float>(y) / r, in);
}

/// By source sample of `table`: sums of colours and of weights (w), each pixel with the weights by which a lookup would mix the samples.
std::vector<glm::vec4> sum_of_photographs(gpu::Device& gpu, SoupBuffers& soup, Frame& frame, const scene::Scene& scene,
                                          std::span<const BatchView> views, std::span<const soup::TextureEntry> table) {
  std::uint64_t pixels = 0;
  for (const BatchView& view : views) pixels += std::uint64_t(view.width) * view.height;
  const std::size_t stride = 1 + pixels / kMostPixels;
  std::vector<glm::vec4> sums(source_samples(table), glm::vec4(0.0f));
  for_each_batch(gpu, soup, frame, views, false, {}, 1, [&](std::size_t view, std::size_t) {
    const auto hits = gpu.download_vector<kernels::Hit>(frame.hits.address(), frame.batch().pixels);
    const std::vector<std::uint8_t>& rgba = scene.train[view].image.rgba;
    for (std::size_t p = view % stride; p < hits.size(); p += stride) {
      if (hits[p].triangle == 0 || rgba[4 * p + 3] < 128) continue;
      const soup::TextureEntry& row = table[hits[p].triangle - 1];
      const glm::vec4 colour(glm::vec3(rgba[4 * p], rgba[4 * p + 1], rgba[4 * p + 2]) / 255.0f, 1.0f);
      glm::vec4* samples = &sums[row.source_offset];
      for (std::uint32_t level = row.level_min; level <= row.level_max; samples += soup::samples_at(level++)) {
        const f32::LatticeCell cell = f32::lattice_cell(hits[p].b0, hits[p].b1, level);
        samples[cell.i0] += cell.w0 * colour;
        samples[cell.i1] += cell.w1 * colour;
        samples[cell.i2] += cell.w2 * colour;
      }
    }
  });
  return sums;
}

/// Logits of one triangle's levels, from its sums. corners: colours that it has so far, in the order of a texture of level 0.
void write_levels(const soup::TextureEntry& row, std::span<const glm::vec4> sums, std::vector<glm::vec3> corners, float opacity, float* to) {
  std::vector<glm::vec3> coarser = std::move(corners), logits;
  std::uint32_t coarser_level = 0;
  for (std::uint32_t level = row.level_min; level <= row.level_max; ++level) {
    std::vector<glm::vec3> colours(soup::samples_at(level)), shown(colours.size());
    for (std::uint32_t i = 0; i < colours.size(); ++i) {
      const glm::vec3 prior = mix(cell_of_sample(i, level, coarser_level), coarser);
      colours[i] = (glm::vec3(sums[i]) + kPrior * prior) / (sums[i].w + kPrior);
      for (int c = 0; c < 3; ++c) shown[i][c] = logit_of(colours[i][c]);
      // Levels are summed: this one adds what the coarser ones do not show yet.
      const glm::vec3 there = logits.empty() ? glm::vec3(0.0f) : mix(cell_of_sample(i, level, coarser_level), logits);
      for (int c = 0; c < 3; ++c) to[c] = shown[i][c] - there[c];
      if (level == row.level_min) to[3] = kMlpShare, to[soup::kChannels - 1] = opacity;
      to += soup::kChannels;
    }
    sums = sums.subspan(colours.size());
    coarser = std::move(colours), logits = std::move(shown);
    coarser_level = level;
  }
}

}  // namespace

gpu::Buffer painted_logits(gpu::Device& gpu, SoupBuffers& soup, Frame& frame, const scene::Scene& scene, std::span<const BatchView> views,
                           std::span<const soup::TextureEntry> table) {
  const std::vector<glm::vec4> sums = sum_of_photographs(gpu, soup, frame, scene, views, table);
  const auto old = soup.shared ? soup.shared->all_values(soup.source) : gpu.download_vector<float>(soup.source.address(), soup.source_samples * soup::kChannels);
  const TriangleRange own = soup.shared ? divided(table, soup.shared->size())[static_cast<std::size_t>(soup.shared->rank())] : all_of(table);
  return upload_logits(gpu, table, own, [&](std::size_t t, float* to) {
    const float* corner = &old[soup.table[t].source_offset * soup::kChannels];
    const float opacity = corner[soup::kChannels - 1];
    std::vector<glm::vec3> corners;
    for (int i = 0; i < 3; ++i, corner += soup::kChannels)
      corners.emplace_back(f32::sigmoid(corner[0]), f32::sigmoid(corner[1]), f32::sigmoid(corner[2]));
    write_levels(table[t], std::span(sums).subspan(table[t].source_offset), std::move(corners), opacity, to);
  });
}

}  // namespace trisoup::train
