#include "scene/ground_planes.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <random>

namespace trisoup::scene {
namespace {

// Normalised units: the cameras' mean distance from the origin is 1. Points that are farther away are less precise, and
// often belong to the horizon.
constexpr double kThickness = 0.02, kReach = 3;
constexpr std::size_t kMostPoints = 3000, kFewestLeft = 50;
constexpr int kTries = 400, kPlanes = 3;

// An even sample of the points within reach.
std::vector<glm::dvec3> near_points(std::span<const glm::vec3> points) {
  std::vector<glm::dvec3> near;
  for (const glm::vec3& p : points)
    if (glm::length(glm::dvec3(p)) < kReach) near.emplace_back(p);
  if (near.size() <= kMostPoints) return near;
  std::vector<glm::dvec3> some;
  for (std::size_t i = 0; i < kMostPoints; ++i) some.push_back(near[i * near.size() / kMostPoints]);
  return some;
}

bool on(const GroundPlane& plane, const glm::dvec3& p) {
  return std::abs(glm::dot(plane.normal, p) - plane.offset) < kThickness;
}

std::optional<GroundPlane> plane_through(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
  const glm::dvec3 normal = glm::cross(b - a, c - a);
  const double length = glm::length(normal);
  if (!(length > 1e-6)) return std::nullopt;
  return GroundPlane{normal / length, glm::dot(normal / length, a), 0};
}

// Fits a plane to its points: through their mean, across their direction of least variance, which is found by inverse
// iteration.
void refit(GroundPlane& plane, const std::vector<glm::dvec3>& points) {
  glm::dvec3 mean(0.0);
  double count = 0;
  for (const glm::dvec3& p : points)
    if (on(plane, p)) mean += p, ++count;
  if (count < 3) return;
  mean /= count;
  glm::dmat3 covariance(1e-9);
  for (const glm::dvec3& p : points)
    if (on(plane, p)) covariance += glm::outerProduct(p - mean, p - mean) / count;
  const glm::dmat3 inverse = glm::inverse(covariance);
  glm::dvec3 normal = plane.normal;
  for (int i = 0; i < 20; ++i) normal = glm::normalize(inverse * normal);
  if (!(std::abs(glm::length(normal) - 1) < 1e-6)) return;  // not finite
  plane.normal = normal;
  plane.offset = glm::dot(normal, mean);
}

GroundPlane largest_plane(const std::vector<glm::dvec3>& points, std::minstd_rand& random) {
  GroundPlane best;
  std::size_t most = 0;
  for (int i = 0; i < kTries; ++i) {
    const auto any = [&] { return points[random() % points.size()]; };
    const glm::dvec3 a = any(), b = any(), c = any();
    const auto plane = plane_through(a, b, c);
    if (!plane) continue;
    const auto count = static_cast<std::size_t>(
        std::count_if(points.begin(), points.end(), [&](const glm::dvec3& p) { return on(*plane, p); }));
    if (count > most) most = count, best = *plane;
  }
  for (int i = 0; i < 3 && most > 0; ++i) refit(best, points);
  return best;
}

// Turns the normal to the cameras. Returns false if they are on both sides.
bool face(GroundPlane& plane, std::span<const glm::dvec3> centres) {
  std::size_t above = 0;
  for (const glm::dvec3& c : centres) above += glm::dot(plane.normal, c) > plane.offset;
  if (2 * above < centres.size()) plane = {-plane.normal, -plane.offset, plane.share}, above = centres.size() - above;
  return 10 * above >= 9 * centres.size();
}

}  // namespace

std::vector<GroundPlane> ground_planes(std::span<const glm::vec3> points, std::span<const glm::dvec3> centres) {
  std::vector<glm::dvec3> left = near_points(points);
  std::vector<GroundPlane> planes;
  const std::size_t all = left.size();
  std::minstd_rand random(1);
  for (int i = 0; i < kPlanes && left.size() >= kFewestLeft; ++i) {
    GroundPlane plane = largest_plane(left, random);
    if (plane.normal == glm::dvec3(0.0)) break;
    const std::size_t before = left.size();
    std::erase_if(left, [&](const glm::dvec3& p) { return on(plane, p); });
    plane.share = double(before - left.size()) / double(all);
    if (face(plane, centres)) planes.push_back(plane);
  }
  return planes;
}

}  // namespace trisoup::scene
