#include "scene/normalisation.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "base/error.h"

namespace trisoup::scene {
namespace {

glm::dvec3 mean_centre_of(std::span<const Camera> cameras) {
  glm::dvec3 mean(0.0);
  for (const Camera& camera : cameras) mean += camera.centre() / double(cameras.size());
  return mean;
}

double mean_distance(std::span<const Camera> cameras, const glm::dvec3& point) {
  double sum = 0;
  for (const Camera& camera : cameras) sum += glm::distance(camera.centre(), point);
  return sum / double(cameras.size());
}

std::optional<double> median_depth(const PointCloud& points, const glm::dvec3& centre, const glm::dvec3& forward) {
  std::vector<double> depths;
  for (const glm::dvec3& point : points.positions)
    if (const double depth = glm::dot(point - centre, forward); depth > 0) depths.push_back(depth);
  if (depths.empty()) return std::nullopt;
  const auto middle = depths.begin() + static_cast<std::ptrdiff_t>(depths.size() / 2);
  std::nth_element(depths.begin(), middle, depths.end());
  return *middle;
}

}  // namespace

// Minimises the sum of squared distances to the optical axes: sum (I - d d^T) (x - c) = 0.
std::optional<glm::dvec3> meeting_point(std::span<const Camera> cameras) {
  const glm::dvec3 mean_centre = mean_centre_of(cameras);
  glm::dmat3 normal(0.0);
  glm::dvec3 right(0.0);
  for (const Camera& camera : cameras) {
    const glm::dvec3 axis = camera.forward();
    const glm::dmat3 across = glm::dmat3(1.0) - glm::outerProduct(axis, axis);
    normal += across;
    right += across * (camera.centre() - mean_centre);
  }
  normal /= double(cameras.size());
  right /= double(cameras.size());
  // The trace is 2 and no eigenvalue exceeds 1. If the smallest eigenvalue is small, the others are near 1, so it is
  // about equal to the determinant. It is the mean squared sine of the angle between an axis and the common direction.
  // 1e-3 is about two degrees.
  if (glm::determinant(normal) < 1e-3) return std::nullopt;
  return mean_centre + glm::inverse(normal) * right;
}

Normalisation find_normalisation(std::span<const Camera> cameras, const PointCloud& points, const std::string& name) {
  const glm::dvec3 mean_centre = mean_centre_of(cameras);
  glm::dvec3 mean_forward(0.0);
  for (const Camera& camera : cameras) mean_forward += camera.forward() / double(cameras.size());
  const double spread = mean_distance(cameras, mean_centre);
  // Files often store seven digits, so smaller distances count as the same position.
  if (cameras.size() > 1 && spread <= 1e-7 * glm::length(mean_centre))
    throw Error(
        "{}: all {} cameras are at one spot; take photographs from different places, so that depth can be determined",
        name, cameras.size());

  Normalisation result;
  if (const auto meeting = meeting_point(cameras)) {
    result.centre = *meeting;
  } else if (const double agreement = glm::length(mean_forward); agreement < 0.5) {
    result.centre = mean_centre;  // cameras on one line that face each other have no common viewing direction
  } else {
    const glm::dvec3 forward = mean_forward / agreement;
    double ahead = 4 * spread;
    if (cameras.size() == 1) ahead = glm::length(mean_centre) > 0 ? glm::length(mean_centre) : 1.0;
    result.centre = mean_centre + median_depth(points, mean_centre, forward).value_or(ahead) * forward;
  }
  const double extent = mean_distance(cameras, result.centre);
  result.scale = 1 / extent;
  if (!std::isfinite(result.scale) || !std::isfinite(extent) || !(result.scale > 0))
    throw Error("{}: the cameras' extent of {} cannot be scaled to 1; correct the poses", name, extent);
  return result;
}

Camera normalised(const Camera& camera, const Normalisation& normalisation) {
  // x_camera = R x + t with x = n / s + c. Camera space is scaled by s too: s x_camera = R n + s (R c + t).
  Camera result = camera;
  const glm::dmat3 rotation(camera.world_to_camera);
  const glm::dvec3 translation(camera.world_to_camera[3]);
  result.world_to_camera[3] = glm::dvec4(normalisation.scale * (rotation * normalisation.centre + translation), 1.0);
  return result;
}

}  // namespace trisoup::scene
