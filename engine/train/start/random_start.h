// Initial triangles around the points of a sparse cloud, at random positions in a box, or from a mesh.
// Section 3.5 and supplementary of Tojo, Bickel, Umetani, "DiffSoup", CVPR 2026.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "mesh/mesh.h"

namespace trisoup::soup {

/// The vertices of an equilateral triangle in the rotated xy plane. The first is centre + rotation * (circumradius, 0,
/// 0).
std::vector<glm::vec3> equilateral_triangle(const glm::vec3& centre, double circumradius, const glm::dmat3& rotation);

struct FromPoints {
  std::size_t farthest_count = 10'000;  // points chosen evenly in space
  std::size_t random_count = 5'000;     // points chosen at random from the rest, so denser where the cloud is dense
  double radius_per_spacing = 0.25;     // circumradius / mean distance of a chosen point to its nearest
  // If that mean exceeds the median by more than this factor, far points dominate it, and triangles of that size would
  // cover the near ones. Each point then uses the mean distance to its own three nearest points instead.
  double uneven = 4.0;
  // Factor of those distances. The vertex learning rate is the same everywhere, so far triangles hardly grow and must
  // cover their surroundings from the start.
  double uneven_size = 4.0;
  std::uint64_t seed = 0;
};

/// One randomly rotated equilateral triangle per chosen point, 3 vertices each. Ignores points that are not finite.
/// Uses all points if there are fewer than requested. Throws Error if there are none, or if all coincide and give no
/// size.
std::vector<glm::vec3> triangles_from_points(std::span<const glm::vec3> points, const FromPoints& options);

/// `count` randomly rotated equilateral triangles with centres uniform in the box low..high, 3 vertices each.
std::vector<glm::vec3> triangles_in_box(std::size_t count, const glm::vec3& low, const glm::vec3& high,
                                        double circumradius, std::uint64_t seed);

/// The triangles of a mesh, 3 vertices each, decimated to at most `budget` triangles by quadric error (Garland,
/// Heckbert 1997). Drops triangles without area. Throws Error if none remain.
std::vector<glm::vec3> triangles_from_mesh(const Mesh& mesh, std::size_t budget);

}  // namespace trisoup::soup
