#include "soup/crop.h"

#include <algorithm>
#include <cstddef>

#include "mesh/triangle_distance.h"

namespace trisoup::soup {
namespace {

bool contains(const CropBox& box, const glm::dvec3& p) {
  return glm::all(glm::greaterThanEqual(p, box.low)) && glm::all(glm::lessThanEqual(p, box.high));
}
bool contains(const CropSphere& sphere, const glm::dvec3& p) {
  return glm::distance(p, sphere.centre) <= sphere.radius;
}

/// Returns the part of a convex polygon on one side of a plane: sign * p[axis] <= sign * limit (Sutherland and Hodgman,
/// "Reentrant polygon clipping", 1974).
std::vector<glm::dvec3> clipped(const std::vector<glm::dvec3>& polygon, int axis, double limit, double sign) {
  std::vector<glm::dvec3> part;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const glm::dvec3 &p = polygon[i], &next = polygon[(i + 1) % polygon.size()];
    const double here = sign * (limit - p[axis]), there = sign * (limit - next[axis]);
    if (here >= 0) part.push_back(p);
    if ((here < 0) != (there < 0)) part.push_back(p + (next - p) * (here / (here - there)));
  }
  return part;
}

bool touches(const CropBox& box, const std::array<glm::dvec3, 3>& triangle) {
  std::vector<glm::dvec3> rest(triangle.begin(), triangle.end());
  for (int axis = 0; axis < 3; ++axis) rest = clipped(clipped(rest, axis, box.high[axis], 1), axis, box.low[axis], -1);
  return !rest.empty();
}
bool touches(const CropSphere& sphere, const std::array<glm::dvec3, 3>& triangle) {
  return contains(sphere, nearest_point(triangle, sphere.centre));
}

template <typename Shape>
bool shape_holds(const Shape& shape, const std::array<glm::dvec3, 3>& triangle, Across across) {
  switch (across) {
    case Across::keep:
      return touches(shape, triangle);
    case Across::centroid:
      return contains(shape, (triangle[0] + triangle[1] + triangle[2]) / 3.0);
    case Across::drop:  // boxes and spheres are convex
      return std::all_of(triangle.begin(), triangle.end(), [&](const auto& corner) { return contains(shape, corner); });
  }
  return false;
}

}  // namespace

bool holds(const CropRegion& region, const std::array<glm::dvec3, 3>& triangle, Across across) {
  const auto holds_it = [&](const auto& shape) { return shape_holds(shape, triangle, across); };
  return std::any_of(region.boxes.begin(), region.boxes.end(), holds_it) ||
         std::any_of(region.spheres.begin(), region.spheres.end(), holds_it);
}

}  // namespace trisoup::soup
