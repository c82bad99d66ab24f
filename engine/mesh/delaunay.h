// Delaunay tetrahedra of points in space.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/glm.hpp>

namespace trisoup::soup {

/// The convex hull of the points, cut into tetrahedra.
struct Tetrahedra {
  static constexpr std::uint32_t kOutside = ~0u;
  std::vector<std::array<std::uint32_t, 4>> corners;  // indices of points
  std::vector<std::array<std::uint32_t, 4>>
      across;  // [k]: the tetrahedron that shares the face opposite corner k, or kOutside
  std::size_t size() const { return corners.size(); }
};

/// No point lies within the sphere through the corners of a tetrahedron (Delaunay 1934), but for roundings: points are
/// moved by some 1e-10 of their extent until no five lie on a sphere (Qhull's joggle, the same in every call). Points
/// must be finite, and not all in one plane: throws Error where there is no tetrahedron.
Tetrahedra delaunay(std::span<const glm::dvec3> points);

}  // namespace trisoup::soup
