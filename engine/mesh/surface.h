// Closed surface from sparse points and the cameras that saw them.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "mesh/mesh.h"

namespace trisoup::soup {

/// Points and the cameras that saw them. The space between a point and each of its cameras is air.
struct Sightings {
  std::span<const glm::dvec3> points;
  /// Per point, indices of cameras. A point without cameras is only a corner of the tetrahedra and casts no votes.
  std::span<const std::vector<std::uint32_t>> seen_by;
  std::span<const glm::dvec3> cameras;  // positions
  /// As seen_by: how many sightings each stands for, where points were merged. Empty: one each.
  std::span<const std::vector<float>> weights = {};
};

struct SurfaceOptions {
  double smoothness = 1.0;  // cost factor of a face, relative to 1 for a contradicted sighting
  /// Faces this far in front of a point hardly contradict its sightings; in units of the distance to its neighbours.
  double softness = 1.0;
};

/// Returns the boundary between air and matter. The Delaunay tetrahedra of the points are labelled air or matter such
/// that as few sightings as possible pass through matter or end in air (Labatut, Pons, Keriven, "Efficient multi-view
/// reconstruction of large-scale scenes using interest points, Delaunay triangulation and graph cuts", ICCV 2007).
/// Everything outside the convex hull is matter, so the surface is closed: a ray from a camera in air always ends on
/// it. The mesh's positions are all input points, with the same indices. Throws the errors of delaunay().
Mesh surface_from_sightings(const Sightings& sightings, const SurfaceOptions& options);

}  // namespace trisoup::soup
