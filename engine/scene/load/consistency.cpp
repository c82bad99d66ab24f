#include "scene/load/consistency.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "scene/normalisation.h"

namespace trisoup::scene {
namespace {

constexpr std::size_t kMaxPoints = 4000;  // points that are compared
constexpr std::size_t kMinPairs = 60;     // points, and pairs of a point and a pixel, that say something
constexpr double kMinColourSpread =
    12.0;  // mean difference of two points' colours, of 255, below which they say nothing

/// y and z of the camera point the other way: OpenGL axes to OpenCV axes, and back.
const glm::dmat4 kOtherAxes(1, 0, 0, 0, 0, -1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1);

glm::dmat4 inverse_of_rigid(const glm::dmat4& m) {
  const glm::dmat3 transposed = glm::transpose(glm::dmat3(m));
  glm::dmat4 result(transposed);
  result[3] = glm::dvec4(-(transposed * glm::dvec3(m[3])), 1.0);
  return result;
}

std::vector<std::size_t> sample(std::size_t count) {
  std::vector<std::size_t> chosen;
  const std::size_t wanted = std::min(count, kMaxPoints);
  for (std::size_t i = 0; i < wanted; ++i) chosen.push_back(i * count / wanted);
  return chosen;
}

double inside_share(std::span<const Camera> cameras, const PointCloud& points, const std::vector<std::size_t>& chosen) {
  std::size_t all = 0, inside = 0;
  for (const std::size_t p : chosen) {
    const glm::dvec3& position = points.positions[p];
    if (!points.seen_by.empty()) {
      for (const std::uint32_t v : points.seen_by[p]) ++all, inside += shown_at(cameras[v], position) ? 1 : 0;
      continue;
    }
    std::size_t views = 0;
    for (std::size_t v = 0; v < cameras.size() && views < 2; ++v) views += shown_at(cameras[v], position) ? 1 : 0;
    ++all, inside += views >= std::min<std::size_t>(2, cameras.size()) ? 1 : 0;
  }
  return all > 0 ? double(inside) / double(all) : 1.0;
}

/// A point and the pixel that shows it, if nothing is in front of it.
struct Pair {
  glm::ivec3 point, pixel;
};

int difference(const glm::ivec3& a, const glm::ivec3& b) {
  return std::abs(a.r - b.r) + std::abs(a.g - b.g) + std::abs(a.b - b.b);
}

std::vector<Pair> pairs_of(std::span<const Camera> cameras, const PointCloud& points, std::span<const Probe> probes,
                           const std::vector<std::size_t>& chosen) {
  std::vector<Pair> pairs;
  for (const Probe& probe : probes) {
    const Camera camera = resized(cameras[probe.view], probe.image.width, probe.image.height);
    for (const std::size_t p : chosen) {
      if (!points.seen_by.empty() && !std::binary_search(points.seen_by[p].begin(), points.seen_by[p].end(),
                                                         static_cast<std::uint32_t>(probe.view)))
        continue;
      const auto shown = shown_at(camera, points.positions[p]);
      if (!shown) continue;
      const std::size_t x = std::size_t(shown->pixel.x), y = std::size_t(shown->pixel.y);
      const std::uint8_t* pixel = &probe.image.rgba[4 * (y * std::size_t(probe.image.width) + x)];
      if (pixel[3] >= 128) pairs.push_back({glm::ivec3(points.colours[p]), {pixel[0], pixel[1], pixel[2]}});
    }
  }
  return pairs;
}

/// A low quantile, because walls hide many points from a view that they project into.
double quantile(std::vector<int>& differences) {
  const auto at = differences.begin() + static_cast<std::ptrdiff_t>(3 * differences.size() / 10);
  std::nth_element(differences.begin(), at, differences.end());
  return *at;
}

std::optional<double> colour_ratio(const std::vector<Pair>& pairs) {
  const std::size_t n = pairs.size();
  if (n < kMinPairs) return std::nullopt;
  std::vector<int> own, other;
  double spread = 0, pixel_spread = 0;
  for (std::size_t i = 0; i < n; ++i) {
    own.push_back(difference(pairs[i].point, pairs[i].pixel));
    // Another point's pixel, far away in the list. Several, so that the quantile is steady.
    for (std::size_t k = 1; k <= 4; ++k) {
      const std::size_t j = (i + k * n / 5 + k) % n;
      other.push_back(difference(pairs[i].point, pairs[j].pixel));
      spread += difference(pairs[i].point, pairs[j].point);
      pixel_spread += difference(pairs[i].pixel, pairs[j].pixel);
    }
  }
  if (std::min(spread, pixel_spread) / double(4 * n) < 3 * kMinColourSpread) return std::nullopt;
  return (quantile(own) + 1) / (quantile(other) + 1);
}

double quantile_of(std::vector<double> values, double share) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * double(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace

glm::dmat4 reread(const glm::dmat4& world_to_camera, PoseReading reading, bool opengl) {
  // With M as written in the file: world_to_camera is F M^-1 for OpenGL files and M for others, F = kOtherAxes.
  const glm::dmat4 inverse = inverse_of_rigid(world_to_camera);
  const glm::dmat4 swapped = opengl ? inverse * kOtherAxes : inverse;  // M, or M^-1
  switch (reading) {
    case PoseReading::as_written:
      return world_to_camera;
    case PoseReading::other_axes:
      return kOtherAxes * world_to_camera;
    case PoseReading::inverse:
      return opengl ? kOtherAxes * swapped : swapped;
    case PoseReading::inverse_other_axes:
      return opengl ? swapped : kOtherAxes * swapped;
  }
  return world_to_camera;
}

std::string to_string(PoseReading reading, bool opengl) {
  const bool other_axes = reading == PoseReading::other_axes || reading == PoseReading::inverse_other_axes;
  const bool inverse = reading == PoseReading::inverse || reading == PoseReading::inverse_other_axes;
  return std::string(opengl != inverse ? "camera-to-world" : "world-to-camera") + " matrices with " +
         (opengl != other_axes ? "OpenGL" : "OpenCV") + " axes";
}

bool PointFit::holds() const {
  if (!colour) return inside >= 0.5;
  // Points that all project into the very views that saw them are hardly wrong, though exposures may differ.
  return inside >= 0.2 && *colour < (observed && inside >= 0.95 ? 0.8 : 0.6);
}
bool PointFit::is_certain() const { return inside >= 0.5 && colour && *colour < 0.5; }

PointFit fit_of_points(std::span<const Camera> cameras, const PointCloud& points, std::span<const Probe> probes) {
  const std::vector<std::size_t> chosen = sample(points.positions.size());
  PointFit fit;
  if (chosen.size() < kMinPairs) return {1.0, std::nullopt, false};  // too few to contradict anything
  fit.inside = inside_share(cameras, points, chosen);
  fit.observed = !points.seen_by.empty();
  if (!points.colours.empty()) fit.colour = colour_ratio(pairs_of(cameras, points, probes, chosen));
  return fit;
}

bool look_inwards(std::span<const Camera> cameras, double max_sine) {
  const auto meeting = meeting_point(cameras);
  if (!meeting) return false;
  double sines = 0;
  for (const Camera& camera : cameras) {
    const glm::dvec3 to_place = *meeting - camera.centre(), axis = camera.forward();
    const double distance = glm::length(to_place), ahead = glm::dot(to_place, axis);
    sines += distance > 0 && ahead > 0 ? glm::length(to_place - ahead * axis) / distance : 1.0;
  }
  return sines / double(cameras.size()) < max_sine;
}

std::vector<std::size_t> far_cameras(std::span<const Camera> cameras, const PointCloud& points) {
  constexpr std::size_t kFewest = 5;
  constexpr double kTimes = 15, kTimesOfScene = 3;
  if (cameras.size() < kFewest) return {};
  glm::dvec3 middle;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> along;
    for (const Camera& camera : cameras) along.push_back(camera.centre()[axis]);
    middle[axis] = quantile_of(std::move(along), 0.5);
  }
  std::vector<double> distances, of_points;
  for (const Camera& camera : cameras) distances.push_back(glm::distance(camera.centre(), middle));
  for (const glm::dvec3& point : points.positions) of_points.push_back(glm::distance(point, middle));
  // Many photographs may be from one tripod, so neither the median nor the cameras alone tell what is far.
  const double limit = std::max(kTimes * quantile_of(distances, 0.75),
                                of_points.empty() ? 0.0 : kTimesOfScene * quantile_of(std::move(of_points), 0.9));
  std::vector<std::size_t> far;
  for (std::size_t i = 0; i < cameras.size(); ++i)
    if (distances[i] > limit && limit > 0) far.push_back(i);
  return far;
}

}  // namespace trisoup::scene
