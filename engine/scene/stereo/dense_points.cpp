#include "scene/stereo/dense_points.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>

#include "scene/stereo/parallax.h"
#include "scene/stereo/support.h"

namespace trisoup::scene {
namespace {

constexpr double kOtherDepth = 0.1;  // smallest relative difference of depths of surfaces that are clearly apart
/// Pixels in an agreeing neighbour. Less than kLeastParallax tells no depth, but may tell that a place is far.
constexpr double kLeastParallax = 2, kLeastFarParallax = 1;
/// Distance of what is far, as a multiple of CameraCloud::radius. It may be off by much and hides nothing near.
constexpr double kFar = 2;
/// A plane is sure if so many neighbours have it too and its cost is at most this.
constexpr int kAgreeing = 2;
constexpr float kSurePlaneCost = 0.4f;
/// Of a point with so many sightings by views that match well, sightings by others do not count.
constexpr std::size_t kEnoughSightings = 4;
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
  if (same_surface(w, own, map.pixel_step)) result.verdict = Verdict::same;
  // A plane that no neighbour has too contradicts nothing.
  else if (apart > kOtherDepth * larger + map.pixel_step && std::popcount(map.agreeing[result.pixel]) >= kAgreeing)
    result.verdict = w > own ? Verdict::nearer : Verdict::farther;
  return result;
}

/// Whether one of the neighbours that agree with a pixel tells its depth, or at least that it is beyond `far`
/// (distance).
bool depth_is_told(std::span<const DepthMap> maps, const DepthMap& map, double far, std::size_t pixel,
                   const glm::dvec3& position) {
  double moved = 0;
  for (std::size_t k = 0; k < map.neighbours.size(); ++k)
    if ((map.agreeing[pixel] >> k) & 1)
      moved = std::max(moved, parallax(maps[map.neighbours[k]].camera, map.camera.centre(), position));
  if (moved >= kLeastParallax) return true;
  if (moved < kLeastFarParallax) return false;
  // With a pixel more of parallax it would be this much nearer.
  return glm::distance(map.camera.centre(), position) / (1.0 + 1.0 / moved) >= far;
}

bool is_sure(const DepthMap& map, std::size_t pixel) {
  return std::popcount(map.agreeing[pixel]) >= kAgreeing && map.planes[pixel].w <= kSurePlaneCost;
}

glm::dvec3 position_of(const DepthMap& map, const glm::dmat4& to_world, int x, int y, double inverse_depth) {
  const Camera& c = map.camera;
  const double z = 1.0 / inverse_depth;
  return glm::dvec3(to_world * glm::dvec4(z * (x + 0.5 - c.cx) / c.fx, z * (y + 0.5 - c.cy) / c.fy, z, 1.0));
}

/// Collects the points of dense_points().
class Fusion {
 public:
  explicit Fusion(std::span<const DepthMap> maps) : maps_(maps), far_(kFar * camera_cloud(maps).radius) {
    for (const DepthMap& map : maps) claimed_.emplace_back(map.planes.size());
  }

  /// Adds points of the planes that are sure, or of those that are not, where no surface has a point yet.
  void add_planes(bool sure) {
    for (std::uint32_t v = 0; v < maps_.size(); ++v) {
      const DepthMap& map = maps_[v];
      if (map.planes.empty()) continue;
      const glm::dmat4 to_world = glm::inverse(map.camera.world_to_camera);
      std::size_t pixel = 0;
      for (int y = 0; y < map.camera.height; ++y)
        for (int x = 0; x < map.camera.width; ++x, ++pixel) {
          const double w = map.planes[pixel].x;
          if (claimed_[v][pixel] || map.agreeing[pixel] == 0 || !(w > 0) || is_sure(map, pixel) != sure) continue;
          const glm::dvec3 position = position_of(map, to_world, x, y, w);
          const bool measured = map.agreeing[pixel] == kMeasured;
          if (measured || depth_is_told(maps_, map, far_, pixel, position)) add(v, measured, position);
        }
    }
  }

  Points take() { return std::move(points_); }

 private:
  void add(std::uint32_t v, bool measured, const glm::dvec3& position) {
    std::vector<std::uint32_t> seen_by, seen_well;
    bool seen_through = false;
    for (std::uint32_t other = 0; other < maps_.size(); ++other) {
      const auto there = sighting(maps_[other], position);
      seen_through = seen_through || (there && there->verdict == Verdict::farther);
      if (!there || !(there->verdict == Verdict::same || other == v)) continue;
      claimed_[other][there->pixel] = true;
      seen_by.push_back(other);
      if (maps_[other].planes[there->pixel].w <= kSurePlaneCost) seen_well.push_back(other);
    }
    if (seen_by.size() < 2 && (!measured || seen_through)) return;
    if (seen_well.size() >= kEnoughSightings) seen_by = std::move(seen_well);
    points_.positions.emplace_back(position);
    points_.seen_by.push_back(std::move(seen_by));
    points_.measured.push_back(measured);
  }

  std::span<const DepthMap> maps_;
  double far_;
  std::vector<std::vector<bool>> claimed_;  // [view][pixel]: its surface has a point
  Points points_;
};

}  // namespace

Points dense_points(std::span<const DepthMap> maps) {
  Fusion fusion(maps);
  for (const bool sure : {true, false}) fusion.add_planes(sure);
  return fusion.take();
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
