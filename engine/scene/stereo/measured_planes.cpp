#include "scene/stereo/measured_planes.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>

#include "base/parallel_for.h"

namespace trisoup::scene {
namespace {

constexpr float kNoPlaneCost = 2.0f;  // above kLargestPlaneCost
constexpr float kEdge = 0.1f;         // relative difference of inverse depths of two surfaces

bool has_depth(const View& view) { return !view.depth.inverse.empty(); }

/// A map without planes.
DepthMap empty_map(const View& view, std::size_t pixels) {
  const MeasuredDepth& depth = view.depth;
  const double own = double(depth.width) * depth.height,
               scale = std::min(1.0, std::sqrt(static_cast<double>(pixels) / std::max(own, 1.0)));
  const auto side = [&](int n) { return std::max(1, static_cast<int>(std::lround(n * scale))); };
  DepthMap map;
  map.camera = resized(view.camera, side(depth.width), side(depth.height));
  const auto count = static_cast<std::size_t>(map.camera.width) * static_cast<std::size_t>(map.camera.height);
  map.planes.assign(count, glm::vec4(0, 0, 0, kNoPlaneCost));
  map.agreeing.assign(count, 0);
  return map;
}

/// The measured plane at a pixel of the map with the camera `small`, or nullopt.
std::optional<glm::vec4> plane_at(const MeasuredDepth& depth, const Camera& small, int x, int y) {
  const auto at = [&](int i, int j) {
    const int column = std::clamp(static_cast<int>((i + 0.5) * depth.width / small.width), 0, depth.width - 1),
              row = std::clamp(static_cast<int>((j + 0.5) * depth.height / small.height), 0, depth.height - 1);
    return depth.inverse[static_cast<std::size_t>(row) * static_cast<std::size_t>(depth.width) +
                         static_cast<std::size_t>(column)];
  };
  const float here = at(x, y), left = at(x - 1, y), right = at(x + 1, y), above = at(x, y - 1), below = at(x, y + 1);
  const float low = std::min({here, left, right, above, below}), high = std::max({here, left, right, above, below});
  if (!(low > 0) || high - low > kEdge * high) return std::nullopt;
  return glm::vec4(here, 0.5f * (right - left), 0.5f * (below - above), 0);
}

}  // namespace

void add_measured_planes(std::span<const View> views, std::size_t pixels, std::vector<DepthMap>& maps) {
  const auto measured = static_cast<std::size_t>(std::count_if(views.begin(), views.end(), has_depth));
  if (measured == 0) return;
  maps.resize(views.size());
  parallel_for(static_cast<int>(views.size()), 0, [&](int index) {
    const auto v = static_cast<std::size_t>(index);
    if (!has_depth(views[v])) return;
    DepthMap& map = maps[v];
    if (map.planes.empty()) map = empty_map(views[v], pixels / measured);
    std::size_t pixel = 0;
    for (int y = 0; y < map.camera.height; ++y)
      for (int x = 0; x < map.camera.width; ++x, ++pixel) {
        if (std::popcount(map.agreeing[pixel]) >= 2 && map.planes[pixel].w <= kLargestPlaneCost) continue;
        const auto plane = plane_at(views[v].depth, map.camera, x, y);
        if (!plane) continue;
        map.planes[pixel] = *plane;
        map.agreeing[pixel] = kMeasured;
      }
  });
}

}  // namespace trisoup::scene
