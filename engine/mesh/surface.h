// A surface from sparse points and the cameras that saw them.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "mesh/mesh.h"

namespace trisoup::soup {

/// Points and who saw them: nothing but air lies between a point and each camera in its list.
struct Sightings {
  std::span<const glm::dvec3> points;
  std::span<const std::vector<std::uint32_t>>
      seen_by;                          // per point, indices of cameras; none: the point is a corner and claims nothing
  std::span<const glm::dvec3> cameras;  // positions
};

struct SurfaceOptions {
  double smoothness = 1.0;  // what a face costs, beside 1 for a sighting that it contradicts
  double softness =
      1.0;  // how far in front of a point a face is still no contradiction, of the distance to its neighbours
};

/// The boundary of what is not air: the points' Delaunay tetrahedra are divided into air and matter so that as few
/// sightings as can be pass through matter or end in air (Labatut, Pons, Keriven, "Efficient multi-view reconstruction
/// of large-scale scenes using interest points, Delaunay triangulation and graph cuts", ICCV 2007). Beyond the convex
/// hull all is matter, so the surface is closed: a ray from a camera that stands in air always ends on it. Corners are
/// points of the input, indices as there. Throws Error as delaunay().
Mesh surface_from_sightings(const Sightings& sightings, const SurfaceOptions& options);

}  // namespace trisoup::soup
