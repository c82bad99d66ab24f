// The triangles a training run starts from: around the points of a sparse cloud, anywhere in a box, or of a mesh.
// Section 3.5 and supplementary of Tojo, Bickel, Umetani, "DiffSoup", CVPR 2026.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "mesh/mesh.h"

namespace trisoup::soup {

/// One equilateral triangle in the plane that `rotation` turns the xy plane to. Its first corner is rotation *
/// (circumradius, 0, 0).
std::vector<glm::vec3> equilateral_triangle(const glm::vec3& centre, double circumradius, const glm::dmat3& rotation);

struct FromPoints {
  std::size_t farthest_count = 10'000;  // spread evenly over space
  std::size_t random_count = 5'000;     // of the remaining points, so denser where the cloud is
  double radius_per_spacing = 0.25;     // circumradius / mean nearest distance of the chosen points
  // Where that mean is more than this many times the median, as in a cloud from hand to horizon, the far points decide
  // it and triangles of its size would bury the near ones: then the mean distance to a point's own three nearest takes
  // its place.
  double uneven = 4.0;
  // And that is multiplied by this: the vertex rate is the same everywhere, so far triangles hardly grow and have to
  // cover their surroundings from the start.
  double uneven_size = 4.0;
  std::uint64_t seed = 0;
};

/// One randomly turned equilateral triangle per chosen point, 3 vertices each. Points that are not finite are passed
/// over; if there are no more points than asked for, all are taken. Throws Error if there are none or all coincide, for
/// then no size can be told.
std::vector<glm::vec3> triangles_from_points(std::span<const glm::vec3> points, const FromPoints& options);

/// `count` randomly turned equilateral triangles centred uniformly in the box low..high, 3 vertices each.
std::vector<glm::vec3> triangles_in_box(std::size_t count, const glm::vec3& low, const glm::vec3& high,
                                        double circumradius, std::uint64_t seed);

/// The triangles of a mesh, decimated to at most `budget` by quadric error (Garland, Heckbert 1997) where it has more;
/// 3 vertices each. Triangles without area are dropped. Throws Error if none remain.
std::vector<glm::vec3> triangles_from_mesh(const Mesh& mesh, std::size_t budget);

}  // namespace trisoup::soup
