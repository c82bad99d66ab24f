// Distances of triangles in space.
#pragma once

#include <array>

#include <glm/glm.hpp>

namespace trisoup::soup {

using Corners3 = std::array<glm::dvec3, 3>;

/// Returns the point of a triangle that is nearest to `point`. The triangle may be a line or a point.
glm::dvec3 nearest_point(const Corners3& triangle, const glm::dvec3& point);

/// Returns the smallest distance between two triangles; 0 if they intersect.
double distance(const Corners3& a, const Corners3& b);

}  // namespace trisoup::soup
