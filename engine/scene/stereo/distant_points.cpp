#include "scene/stereo/distant_points.h"

#include <algorithm>
#include <cmath>

#include "base/parallel_for.h"
#include "base/sphere_lattice.h"
#include "scene/stereo/parallax.h"

namespace trisoup::scene {
namespace {

constexpr int kDirections = 4096;
/// Largest parallax of what is distant, and smallest one of what is near; pixels.
constexpr double kDistant = 2, kNear = 4;
/// Inverse depth that the neighbours of a distant pixel must be able to tell from 0, in steps of a pixel.
constexpr double kTold = 8;
/// Pixels on each side that decide on a pixel, how many must be distant, and how many times as many as are near.
constexpr int kWindow = 4, kLeastDistant = 4, kMajority = 8;

enum class Reach : std::uint8_t { unknown, distant, near };

Reach reach_of_pixel(std::span<const DepthMap> maps, const DepthMap& map, int x, int y) {
  const Camera& c = map.camera;
  const std::size_t pixel =
      static_cast<std::size_t>(y) * static_cast<std::size_t>(c.width) + static_cast<std::size_t>(x);
  const std::uint32_t agreeing = map.agreeing[pixel];
  if (agreeing == 0) return Reach::unknown;
  const glm::dvec3 eye = c.centre(), ray = glm::transpose(glm::dmat3(c.world_to_camera)) *
                                           glm::dvec3((x + 0.5 - c.cx) / c.fx, (y + 0.5 - c.cy) / c.fy, 1.0);
  const double w = std::max<double>(map.planes[pixel].x, 1e-9), told = kTold * map.pixel_step;
  double moved = 0, would_move = 0;
  for (std::size_t k = 0; k < map.neighbours.size(); ++k) {
    if (!((agreeing >> k) & 1)) continue;
    const Camera& other = maps[map.neighbours[k]].camera;
    moved = std::max(moved, parallax(other, eye, eye + ray / w));
    would_move = std::max(would_move, parallax(other, eye, eye + ray / told));
  }
  if (moved > kNear) return Reach::near;
  return moved <= kDistant && would_move >= kNear ? Reach::distant : Reach::unknown;
}

/// Per pixel, whether most of what is known around it is distant.
std::vector<bool> distant_pixels(std::span<const DepthMap> maps, const DepthMap& map) {
  const int width = map.camera.width, height = map.camera.height;
  std::vector<Reach> reach;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) reach.push_back(reach_of_pixel(maps, map, x, y));
  std::vector<bool> result(reach.size());
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      int distant = 0, near = 0;
      for (int j = std::max(0, y - kWindow); j <= std::min(height - 1, y + kWindow); ++j)
        for (int i = std::max(0, x - kWindow); i <= std::min(width - 1, x + kWindow); ++i) {
          const Reach there =
              reach[static_cast<std::size_t>(j) * static_cast<std::size_t>(width) + static_cast<std::size_t>(i)];
          distant += there == Reach::distant;
          near += there == Reach::near;
        }
      result[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)] =
          distant >= kLeastDistant && distant >= kMajority * near;
    }
  return result;
}

/// Radius of a sphere round the cameras on which none of them is off by more than a pixel.
double radius_of(std::span<const DepthMap> maps, const CameraCloud& cameras) {
  double focal = 0;
  for (const DepthMap& map : maps)
    if (!map.planes.empty()) focal = std::max({focal, map.camera.fx, map.camera.fy});
  return cameras.radius * focal;
}

}  // namespace

Points distant_points(std::span<const DepthMap> maps) {
  const CameraCloud cameras = camera_cloud(maps);
  const double radius = radius_of(maps, cameras);
  std::vector<std::vector<bool>> distant(maps.size());
  parallel_for(static_cast<int>(maps.size()), 0, [&](int v) {
    const auto i = static_cast<std::size_t>(v);
    if (!maps[i].planes.empty()) distant[i] = distant_pixels(maps, maps[i]);
  });
  Points points;
  for (int i = 0; i < kDirections; ++i) {
    const glm::dvec3 place = cameras.centre + radius * sphere_lattice(i, kDirections);
    std::vector<std::uint32_t> seen_by;
    for (std::uint32_t v = 0; v < maps.size(); ++v) {
      if (distant[v].empty()) continue;
      const auto shown = shown_at(maps[v].camera, place);
      if (!shown) continue;
      const auto pixel = static_cast<std::size_t>(shown->pixel.y) * static_cast<std::size_t>(maps[v].camera.width) +
                         static_cast<std::size_t>(shown->pixel.x);
      if (distant[v][pixel]) seen_by.push_back(v);
    }
    if (seen_by.size() < 2) continue;
    points.positions.emplace_back(place);
    points.seen_by.push_back(std::move(seen_by));
  }
  points.distant = points.positions.size();
  return points;
}

}  // namespace trisoup::scene
