#include "mesh/triangle_distance.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

namespace trisoup::soup {
namespace {

double squared(const glm::dvec3& v) { return glm::dot(v, v); }

glm::dvec3 nearest_on_edge(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& point) {
  const glm::dvec3 edge = b - a;
  const double length = squared(edge);
  return length > 0 ? a + std::clamp(glm::dot(point - a, edge) / length, 0.0, 1.0) * edge : a;
}

/// Returns the squared distance of the edges a..b and c..d. Where the lines come nearest within both edges, that is the
/// distance. Otherwise an end is nearest, and those are covered by the distances of corners to triangles.
double edges_apart(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, const glm::dvec3& d) {
  const glm::dvec3 u = b - a, v = d - c, w = a - c;
  const double uu = squared(u), uv = glm::dot(u, v), vv = squared(v), uw = glm::dot(u, w), vw = glm::dot(v, w);
  const double determinant = uu * vv - uv * uv;
  if (!(determinant > 1e-14 * uu * vv)) return std::numeric_limits<double>::infinity();  // parallel: an end is nearest
  const double s = (uv * vw - vv * uw) / determinant, t = (uu * vw - uv * uw) / determinant;
  if (s < 0 || s > 1 || t < 0 || t > 1) return std::numeric_limits<double>::infinity();
  return squared(w + s * u - t * v);
}

/// Whether the edge a..b passes through the triangle.
bool passes(const Corners3& triangle, const glm::dvec3& a, const glm::dvec3& b) {
  const auto volume = [](const glm::dvec3& p, const glm::dvec3& q, const glm::dvec3& r) {
    return glm::dot(p, glm::cross(q, r));
  };
  const glm::dvec3 edge = b - a;
  const glm::dvec3 normal = glm::cross(triangle[1] - triangle[0], triangle[2] - triangle[0]);
  const double before = glm::dot(normal, a - triangle[0]), after = glm::dot(normal, b - triangle[0]);
  if (before * after > 0 || before == after) return false;
  const double side0 = volume(edge, triangle[0] - a, triangle[1] - a);
  const double side1 = volume(edge, triangle[1] - a, triangle[2] - a);
  const double side2 = volume(edge, triangle[2] - a, triangle[0] - a);
  return (side0 >= 0 && side1 >= 0 && side2 >= 0) || (side0 <= 0 && side1 <= 0 && side2 <= 0);
}

/// Whether the foot of the perpendicular from `point` lies in the triangle; then `foot` is that point.
bool foot_in(const Corners3& triangle, const glm::dvec3& point, glm::dvec3& foot) {
  const glm::dvec3 u = triangle[1] - triangle[0], v = triangle[2] - triangle[0], normal = glm::cross(u, v);
  const double area = squared(normal);
  if (!(area > 0)) return false;
  const glm::dvec3 w = point - triangle[0];
  const double b1 = glm::dot(glm::cross(w, v), normal) / area, b2 = glm::dot(glm::cross(u, w), normal) / area;
  foot = triangle[0] + b1 * u + b2 * v;
  return b1 >= 0 && b2 >= 0 && b1 + b2 <= 1;
}

}  // namespace

glm::dvec3 nearest_point(const Corners3& triangle, const glm::dvec3& point) {
  glm::dvec3 best;
  if (foot_in(triangle, point, best)) return best;
  best = triangle[0];
  for (std::size_t k = 0; k < 3; ++k) {
    const glm::dvec3 candidate = nearest_on_edge(triangle[k], triangle[(k + 1) % 3], point);
    if (squared(candidate - point) < squared(best - point)) best = candidate;
  }
  return best;
}

double distance(const Corners3& a, const Corners3& b) {
  double best = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < 3; ++i) {
    if (passes(b, a[i], a[(i + 1) % 3]) || passes(a, b[i], b[(i + 1) % 3])) return 0;
    best = std::min({best, squared(nearest_point(b, a[i]) - a[i]), squared(nearest_point(a, b[i]) - b[i])});
    for (std::size_t j = 0; j < 3; ++j) best = std::min(best, edges_apart(a[i], a[(i + 1) % 3], b[j], b[(j + 1) % 3]));
  }
  return std::sqrt(best);
}

}  // namespace trisoup::soup
