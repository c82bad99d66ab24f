#include "scene/stereo/dense_points.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <optional>

#include "base/parallel_for.h"

namespace trisoup::scene {
namespace {

constexpr double kSamePixel = 1.0, kSameDepth = 0.03;
constexpr double kLeastParallax = 2;  // pixels in the neighbour with the widest baseline; less tells no depth

struct Sighting {
  std::size_t pixel;
  bool agrees;
};

/// The pixel of a map that shows a position, and whether its plane is there.
std::optional<Sighting> sighting(const DepthMap& map, const glm::dvec3& position) {
  const Camera& camera = map.camera;
  const glm::dvec3 c(camera.world_to_camera * glm::dvec4(position, 1.0));
  if (!(c.z > 1e-6) || map.planes.empty()) return std::nullopt;
  const double x = camera.fx * c.x / c.z + camera.cx, y = camera.fy * c.y / c.z + camera.cy;
  if (!(x >= 0 && y >= 0 && x < camera.width && y < camera.height)) return std::nullopt;
  const int i = static_cast<int>(x), j = static_cast<int>(y);
  const std::size_t pixel = static_cast<std::size_t>(j) * static_cast<std::size_t>(camera.width) +
                            static_cast<std::size_t>(i);
  const glm::vec4 plane = map.planes[pixel];
  if (plane.w > kLargestPlaneCost) return Sighting{pixel, false};
  const double w = plane.x + plane.y * (x - 0.5 - i) + plane.z * (y - 0.5 - j);
  return Sighting{pixel, std::abs(w - 1.0 / c.z) <= kSameDepth * std::max(w, 1.0 / c.z)};
}

glm::dvec3 position_of(const DepthMap& map, const glm::dmat4& to_world, int x, int y, double inverse_depth) {
  const Camera& c = map.camera;
  const double z = 1.0 / inverse_depth;
  return glm::dvec3(to_world * glm::dvec4(z * (x + 0.5 - c.cx) / c.fx, z * (y + 0.5 - c.cy) / c.fy, z, 1.0));
}

glm::u8vec3 colour_of(const View& view, const Camera& small, int x, int y) {
  const Image& image = view.image;
  const int i = std::min(image.width - 1, static_cast<int>((x + 0.5) * image.width / small.width)),
            j = std::min(image.height - 1, static_cast<int>((y + 0.5) * image.height / small.height));
  const std::uint8_t* p = &image.rgba[4 * (static_cast<std::size_t>(j) * static_cast<std::size_t>(image.width) +
                                           static_cast<std::size_t>(i))];
  return {p[0], p[1], p[2]};
}

}  // namespace

Points dense_points(std::span<const View> views, std::span<const DepthMap> maps) {
  static const int need = std::getenv("TS_NEED") ? std::atoi(std::getenv("TS_NEED")) : 2;
  Points points;
  std::vector<std::vector<bool>> claimed(maps.size());
  for (std::size_t v = 0; v < maps.size(); ++v) claimed[v].resize(maps[v].planes.size());
  for (std::uint32_t v = 0; v < maps.size(); ++v) {
    const DepthMap& map = maps[v];
    if (map.planes.empty()) continue;
    const glm::dmat4 to_world = glm::inverse(map.camera.world_to_camera);
    for (int y = 0; y < map.camera.height; ++y)
      for (int x = 0; x < map.camera.width; ++x) {
        const auto pixel = static_cast<std::size_t>(y) * static_cast<std::size_t>(map.camera.width) +
                           static_cast<std::size_t>(x);
        const double w = map.planes[pixel].x;
        if (claimed[v][pixel] || std::popcount(map.agreeing[pixel]) < need || w < kLeastParallax * map.pixel_step)
          continue;
        const glm::dvec3 position = position_of(map, to_world, x, y, w);
        std::vector<std::uint32_t> seen_by;
        for (std::uint32_t other = 0; other < maps.size(); ++other) {
          const auto there = sighting(maps[other], position);
          if (!there || !(there->agrees || other == v)) continue;
          claimed[other][there->pixel] = true;
          seen_by.push_back(other);
        }
        if (seen_by.size() < static_cast<std::size_t>(need) + 1) continue;
        points.positions.emplace_back(position);
        points.colours.push_back(colour_of(views[v], map.camera, x, y));
        points.seen_by.push_back(std::move(seen_by));
      }
  }
  return points;
}

}  // namespace trisoup::scene
