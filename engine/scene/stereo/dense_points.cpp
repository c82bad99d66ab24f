#include "scene/stereo/dense_points.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>

#include "scene/stereo/parallax.h"

namespace trisoup::scene {
namespace {

/// Largest relative difference of depths of one surface, and smallest one of surfaces that are clearly apart.
constexpr double kSameDepth = 0.03, kOtherDepth = 0.1;
/// Inverse depth, in steps of a pixel, up to which depths of one surface may differ by a pixel.
constexpr double kFewSteps = 8;
/// Pixels in an agreeing neighbour. Less than kLeastParallax tells no depth, but may tell that a place is far.
constexpr double kLeastParallax = 2, kLeastFarParallax = 1;
/// Distance of what is far, as a multiple of CameraCloud::radius. It may be off by much and hides nothing near.
constexpr double kFar = 2;
/// Neighbours that must have a point too; one is enough where no more than kFewShow show its place.
constexpr int kAgreeing = 2, kFewShow = 2;
constexpr std::size_t kLeastSightings = 3;  // of a point that was not found here

enum class Verdict { unknown, same, nearer, farther };  // the plane than the position
struct Sighting {
  std::size_t pixel = 0;
  Verdict verdict = Verdict::unknown;
};

/// The pixel of a map that shows a position, and whether its plane is there. Returns nullopt if none shows it.
std::optional<Sighting> sighting(const DepthMap& map, const glm::dvec3& position) {
  const Camera& camera = map.camera;
  if (map.planes.empty()) return std::nullopt;
  const auto shown = shown_at(camera, position);
  if (!shown) return std::nullopt;
  const double x = shown->pixel.x, y = shown->pixel.y;
  const int i = static_cast<int>(x), j = static_cast<int>(y);
  Sighting result;
  result.pixel = static_cast<std::size_t>(j) * static_cast<std::size_t>(camera.width) + static_cast<std::size_t>(i);
  const glm::vec4 plane = map.planes[result.pixel];
  if (plane.w > kLargestPlaneCost) return result;
  const double w = plane.x + plane.y * (x - 0.5 - i) + plane.z * (y - 0.5 - j), own = 1.0 / shown->depth;
  const double apart = std::abs(w - own), larger = std::max(w, own);
  const bool moves_little = larger <= kFewSteps * map.pixel_step;
  if (apart <= std::max(kSameDepth * larger, moves_little ? map.pixel_step : 0.0)) result.verdict = Verdict::same;
  // A plane that no neighbour has too contradicts nothing.
  else if (apart > kOtherDepth * larger + map.pixel_step && std::popcount(map.agreeing[result.pixel]) >= kAgreeing)
    result.verdict = w > own ? Verdict::nearer : Verdict::farther;
  return result;
}

/// Whether enough neighbours agree with a pixel: two, or one where few show its place; and whether one of them tells
/// its depth, or at least that it is beyond `far` (distance).
bool vouched_for(std::span<const DepthMap> maps, const DepthMap& map, double far, std::size_t pixel,
                 const glm::dvec3& position) {
  const std::uint32_t agreeing = map.agreeing[pixel];
  const bool alone = std::popcount(agreeing) < kAgreeing;
  int showing = 0;
  double moved = 0;
  for (std::size_t k = 0; k < map.neighbours.size(); ++k) {
    const Camera& other = maps[map.neighbours[k]].camera;
    if (alone && shown_at(other, position) && ++showing > kFewShow) return false;
    if ((agreeing >> k) & 1) moved = std::max(moved, parallax(other, map.camera.centre(), position));
  }
  if (moved >= kLeastParallax) return true;
  if (moved < kLeastFarParallax) return false;
  // With a pixel more of parallax it would be this much nearer.
  return glm::distance(map.camera.centre(), position) / (1.0 + 1.0 / moved) >= far;
}

glm::dvec3 position_of(const DepthMap& map, const glm::dmat4& to_world, int x, int y, double inverse_depth) {
  const Camera& c = map.camera;
  const double z = 1.0 / inverse_depth;
  return glm::dvec3(to_world * glm::dvec4(z * (x + 0.5 - c.cx) / c.fx, z * (y + 0.5 - c.cy) / c.fy, z, 1.0));
}

}  // namespace

Points dense_points(std::span<const DepthMap> maps) {
  const double far = kFar * camera_cloud(maps).radius;
  Points points;
  std::vector<std::vector<bool>> claimed(maps.size());
  for (std::size_t v = 0; v < maps.size(); ++v) claimed[v].resize(maps[v].planes.size());
  const auto add = [&](std::uint32_t v, bool measured, const glm::dvec3& position) {
    std::vector<std::uint32_t> seen_by;
    bool seen_through = false;
    for (std::uint32_t other = 0; other < maps.size(); ++other) {
      const auto there = sighting(maps[other], position);
      seen_through = seen_through || (there && there->verdict == Verdict::farther);
      if (!there || !(there->verdict == Verdict::same || other == v)) continue;
      claimed[other][there->pixel] = true;
      seen_by.push_back(other);
    }
    if (seen_by.size() < 2 && (!measured || seen_through)) return;
    points.positions.emplace_back(position);
    points.seen_by.push_back(std::move(seen_by));
    points.measured.push_back(measured);
  };
  for (std::uint32_t v = 0; v < maps.size(); ++v) {
    const DepthMap& map = maps[v];
    if (map.planes.empty()) continue;
    const glm::dmat4 to_world = glm::inverse(map.camera.world_to_camera);
    for (int y = 0; y < map.camera.height; ++y)
      for (int x = 0; x < map.camera.width; ++x) {
        const auto pixel =
            static_cast<std::size_t>(y) * static_cast<std::size_t>(map.camera.width) + static_cast<std::size_t>(x);
        const double w = map.planes[pixel].x;
        if (claimed[v][pixel] || map.agreeing[pixel] == 0 || !(w > 0)) continue;
        const glm::dvec3 position = position_of(map, to_world, x, y, w);
        const bool measured = map.agreeing[pixel] == kMeasured;
        if (measured || vouched_for(maps, map, far, pixel, position)) add(v, measured, position);
      }
  }
  return points;
}

Points checked_sightings(const Points& points, std::span<const DepthMap> maps) {
  Points result;
  for (std::size_t i = 0; i < points.positions.size(); ++i) {
    std::vector<std::uint32_t> seen_by;
    const std::vector<std::uint32_t> listed = points.seen_by.empty() ? std::vector<std::uint32_t>{} : points.seen_by[i];
    for (std::uint32_t v = 0; v < maps.size(); ++v) {
      const auto there = sighting(maps[v], glm::dvec3(points.positions[i]));
      const bool is_listed = std::binary_search(listed.begin(), listed.end(), v);
      const Verdict verdict = there ? there->verdict : Verdict::unknown;
      if (verdict == Verdict::same || (is_listed && verdict == Verdict::unknown)) seen_by.push_back(v);
    }
    if (seen_by.size() < kLeastSightings) continue;
    result.positions.push_back(points.positions[i]);
    if (!points.colours.empty()) result.colours.push_back(points.colours[i]);
    if (!points.errors.empty()) result.errors.push_back(points.errors[i]);
    result.seen_by.push_back(std::move(seen_by));
  }
  return result;
}

}  // namespace trisoup::scene
