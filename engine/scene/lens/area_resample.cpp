#include "scene/lens/area_resample.h"

#include <algorithm>
#include <cmath>

namespace trisoup::scene {
namespace {

// The source pixels first, first + 1, ... that a target pixel covers along one axis, and the weight of each.
struct Cover {
  int first = 0;
  std::vector<float> shares;  // sum 1
};

std::vector<Cover> covers(int source, int target) {
  std::vector<Cover> result(static_cast<std::size_t>(target));
  for (int i = 0; i < target; ++i) {
    // In units of 1 / target of a source pixel, all borders are integers, so the weights are exact.
    const auto begin = std::int64_t(i) * source, end = begin + source;
    Cover& cover = result[static_cast<std::size_t>(i)];
    cover.first = static_cast<int>(begin / target);
    for (std::int64_t pixel = cover.first; pixel * target < end; ++pixel) {
      const auto length = std::min(end, (pixel + 1) * target) - std::max(begin, pixel * target);
      cover.shares.push_back(static_cast<float>(double(length) / source));
    }
  }
  return result;
}

struct Sums {
  glm::vec4 inside{0.0f};  // weighted colour of the pixels in the loss
  float weight = 0;        // sum of their weights
  glm::vec4 all{0.0f};     // weighted colour of all pixels; used only with a mask
};

// Adds one source row, resampled along x, to the sums of a target row.
void add_row(const Photograph& photograph, int row, float share, const std::vector<Cover>& columns,
             std::vector<Sums>& sums) {
  const std::size_t start = std::size_t(row) * std::size_t(photograph.width);
  const bool masked = !photograph.inside.empty();
  for (std::size_t x = 0; x < columns.size(); ++x) {
    std::size_t i = start + std::size_t(columns[x].first);
    for (const float column_share : columns[x].shares) {
      const float weight = share * column_share;
      const glm::vec4 colour = weight * glm::vec4(photograph.colour[i]);
      if (masked) sums[x].all += colour;
      if (!masked || photograph.inside[i] != 0) {
        sums[x].inside += colour;
        sums[x].weight += weight;
      }
      ++i;
    }
  }
}

}  // namespace

Photograph area_resample(const Photograph& photograph, int width, int height) {
  if (width == photograph.width && height == photograph.height) return photograph;
  const std::vector<Cover> columns = covers(photograph.width, width), rows = covers(photograph.height, height);
  Photograph result{width, height, {}, {}};
  result.colour.reserve(result.pixels());
  const bool masked = !photograph.inside.empty();
  if (masked) result.inside.reserve(result.pixels());

  std::vector<Sums> sums(columns.size());
  for (const Cover& cover : rows) {
    std::fill(sums.begin(), sums.end(), Sums{});
    int row = cover.first;
    for (const float share : cover.shares) add_row(photograph, row++, share, columns, sums);
    for (const Sums& sum : sums) {
      constexpr float some = 1e-6f;  // smaller weights are rounding errors
      const glm::vec4 mean = sum.weight > some ? sum.inside / sum.weight : sum.all;
      result.colour.emplace_back(glm::min(mean + 0.5f, 255.0f));
      if (masked) result.inside.push_back(sum.weight >= 0.5f - some ? 255 : 0);
    }
  }
  return result;
}

}  // namespace trisoup::scene
