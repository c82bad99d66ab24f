// Delaunay tetrahedralisation of 3D points.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/glm.hpp>

namespace trisoup::soup {

/// Tetrahedra that fill the convex hull of the points.
struct Tetrahedra {
  static constexpr std::uint32_t kOutside = ~0u;
  std::vector<std::array<std::uint32_t, 4>> corners;  // indices of points
  /// [t][k]: the tetrahedron that shares the face opposite corner k of t, or kOutside.
  std::vector<std::array<std::uint32_t, 4>> across;
  /// The points as jittered. Tetrahedra are valid with these; a flat one may be inside out with the points as given.
  std::vector<glm::dvec3> points;
  std::size_t size() const { return corners.size(); }
};

/// Returns the Delaunay tetrahedralisation: no point lies inside the circumsphere of a tetrahedron (Delaunay 1934), up
/// to rounding. Points are jittered so that no five lie on a sphere (Qhull's joggle, deterministic), as little as
/// rounding allows: the farther the farthest point, the more. Points must be finite. Throws Error if there are fewer
/// than five points or no tetrahedron exists, for example if all points lie in one plane.
Tetrahedra delaunay(std::span<const glm::dvec3> points);

}  // namespace trisoup::soup
