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
  glm::dvec2 place{};  // in the map's picture; pixel centres have .5
  std::size_t pixel = 0;
  Verdict verdict = Verdict::unknown;
  double inverse_depth = 0;  // of the plane there, if it is the same point
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
  result.place = shown->pixel;
  result.pixel = static_cast<std::size_t>(j) * static_cast<std::size_t>(camera.width) + static_cast<std::size_t>(i);
  const glm::vec4 plane = map.planes[result.pixel];
  if (plane.w > kLargestPlaneCost) return result;
  const double w = plane.x + plane.y * (x - 0.5 - i) + plane.z * (y - 0.5 - j), own = 1.0 / shown->depth;
  const double apart = std::abs(w - own), larger = std::max(w, own);
  const bool moves_little = larger <= kFewSteps * map.pixel_step;
  if (apart <= std::max(kSameDepth * larger, moves_little ? map.pixel_step : 0.0)) {
    result.verdict = Verdict::same;
    result.inverse_depth = w;
  } else if (apart > kOtherDepth * larger + map.pixel_step && std::popcount(map.agreeing[result.pixel]) >= kAgreeing) {
    result.verdict = w > own ? Verdict::nearer : Verdict::farther;  // planes of one view alone contradict nothing
  }
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

/// Inverse depth of a point along the ray of one view, as several views have it: a mean, weighted by the inverse of the
/// variance, for which the views' steps of a pixel stand.
struct MeanInverseDepth {
  double sum = 0, weight = 0;
  void add(double inverse_depth, double pixel_step) {
    if (!(pixel_step > 0)) return;
    const double share = 1.0 / (pixel_step * pixel_step);
    sum += share * inverse_depth;
    weight += share;
  }
  double value_or(double own) const { return weight > 0 ? sum / weight : own; }
};

/// Joins the pixels of all maps that show the same point.
class Fusion {
 public:
  explicit Fusion(std::span<const DepthMap> maps) : maps_(maps) {
    for (const DepthMap& map : maps) {
      claimed_.emplace_back(map.planes.size());
      to_world_.push_back(glm::inverse(map.camera.world_to_camera));
    }
  }

  bool is_claimed(std::uint32_t view, std::size_t pixel) const { return claimed_[view][pixel]; }

  /// The point at a place of a view's picture.
  glm::dvec3 position(std::uint32_t view, const glm::dvec2& place, double inverse_depth) const {
    const Camera& c = maps_[view].camera;
    const double z = 1.0 / inverse_depth;
    return glm::dvec3(to_world_[view] * glm::dvec4(z * (place.x - c.cx) / c.fx, z * (place.y - c.cy) / c.fy, z, 1.0));
  }

  /// Adds the point of a view's pixel, at the mean depth of the views that show the same, unless no other does.
  void add(std::uint32_t view, const glm::dvec2& place, double inverse_depth, bool measured, Points& points) {
    const glm::dvec3 own = position(view, place, inverse_depth);
    const glm::dmat4& to_view = maps_[view].camera.world_to_camera;
    MeanInverseDepth mean;
    std::vector<std::uint32_t> seen_by;
    bool seen_through = false;
    for (std::uint32_t other = 0; other < maps_.size(); ++other) {
      const auto there = sighting(maps_[other], own);
      seen_through = seen_through || (there && there->verdict == Verdict::farther);
      if (!there || !(there->verdict == Verdict::same || other == view)) continue;
      claimed_[other][there->pixel] = true;
      seen_by.push_back(other);
      const std::uint32_t agreeing = maps_[other].agreeing[there->pixel];
      if (other == view || !(there->inverse_depth > 0) || agreeing == 0 || agreeing == kMeasured) continue;
      const double z = (to_view * glm::dvec4(position(other, there->place, there->inverse_depth), 1.0)).z;
      if (z > 0) mean.add(1.0 / z, maps_[other].pixel_step);
    }
    if (seen_by.size() < 2 && (!measured || seen_through)) return;
    if (!measured) mean.add(inverse_depth, maps_[view].pixel_step);
    points.positions.emplace_back(measured ? own : position(view, place, mean.value_or(inverse_depth)));
    points.seen_by.push_back(std::move(seen_by));
    points.measured.push_back(measured);
  }

 private:
  std::span<const DepthMap> maps_;
  std::vector<std::vector<bool>> claimed_;
  std::vector<glm::dmat4> to_world_;
};

}  // namespace

Points dense_points(std::span<const DepthMap> maps) {
  const double far = kFar * camera_cloud(maps).radius;
  Points points;
  Fusion fusion(maps);
  for (std::uint32_t v = 0; v < maps.size(); ++v) {
    const DepthMap& map = maps[v];
    if (map.planes.empty()) continue;
    for (int y = 0; y < map.camera.height; ++y)
      for (int x = 0; x < map.camera.width; ++x) {
        const auto pixel =
            static_cast<std::size_t>(y) * static_cast<std::size_t>(map.camera.width) + static_cast<std::size_t>(x);
        const double w = map.planes[pixel].x;
        if (fusion.is_claimed(v, pixel) || map.agreeing[pixel] == 0 || !(w > 0)) continue;
        const glm::dvec2 place{x + 0.5, y + 0.5};
        const bool measured = map.agreeing[pixel] == kMeasured;
        if (measured || vouched_for(maps, map, far, pixel, fusion.position(v, place, w)))
          fusion.add(v, place, w, measured, points);
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
