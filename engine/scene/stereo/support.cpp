#include "scene/stereo/support.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

namespace trisoup::scene {
namespace {

constexpr double kSameDepth = 0.03;  // largest relative difference
/// Inverse depth, in steps of a pixel, up to which depths of one surface may differ by a pixel.
constexpr double kFewSteps = 8;
/// Pixels on each side that support a plane, and the smallest share of them.
constexpr int kSupportReach = 3;
constexpr double kLeastSupport = 1.0 / 3;

bool is_supported(const DepthMap& map, int x, int y) {
  const auto index = [&](int i, int j) {
    return static_cast<std::size_t>(j) * static_cast<std::size_t>(map.camera.width) + static_cast<std::size_t>(i);
  };
  const glm::vec4 plane = map.planes[index(x, y)];
  int same = -1, all = -1;  // without the pixel itself
  for (int j = std::max(0, y - kSupportReach); j <= std::min(map.camera.height - 1, y + kSupportReach); ++j)
    for (int i = std::max(0, x - kSupportReach); i <= std::min(map.camera.width - 1, x + kSupportReach); ++i) {
      ++all;
      const std::size_t there = index(i, j);
      if (map.agreeing[there] == 0) continue;
      const double w = plane.x + plane.y * static_cast<float>(i - x) + plane.z * static_cast<float>(j - y);
      same += (i == x && j == y) || same_surface(w, map.planes[there].x, map.pixel_step);
    }
  return same >= kLeastSupport * all;
}

}  // namespace

bool same_surface(double inverse_depth, double other, double pixel_step) {
  const double larger = std::max(inverse_depth, other);
  return std::abs(inverse_depth - other) <=
         std::max(kSameDepth * larger, larger <= kFewSteps * pixel_step ? pixel_step : 0.0);
}

void drop_unsupported(DepthMap& map) {
  if (map.planes.empty()) return;
  std::vector<std::uint32_t> agreeing = map.agreeing;
  std::size_t pixel = 0;
  for (int y = 0; y < map.camera.height; ++y)
    for (int x = 0; x < map.camera.width; ++x, ++pixel)
      if (std::popcount(agreeing[pixel]) == 1 && !is_supported(map, x, y)) agreeing[pixel] = 0;
  map.agreeing = std::move(agreeing);
}

}  // namespace trisoup::scene
