#include "train/start/random_start.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "base/error.h"
#include "mesh/decimate.h"
#include "mesh/point_spacing.h"
#include "soup/random.h"

namespace trisoup::soup {
namespace {

void append(std::vector<glm::vec3>& to, const std::vector<glm::vec3>& triangle) {
  to.insert(to.end(), triangle.begin(), triangle.end());
}

}  // namespace

std::vector<glm::vec3> equilateral_triangle(const glm::vec3& centre, double circumradius, const glm::dmat3& rotation) {
  const double half_side = std::sqrt(3.0) / 2.0;
  const glm::dvec3 corners[] = {{1, 0, 0}, {-0.5, half_side, 0}, {-0.5, -half_side, 0}};
  std::vector<glm::vec3> triangle;
  for (const glm::dvec3& corner : corners)
    triangle.emplace_back(glm::dvec3(centre) + circumradius * (rotation * corner));
  return triangle;
}

std::vector<glm::vec3> triangles_from_points(std::span<const glm::vec3> points, const FromPoints& options) {
  std::vector<glm::vec3> finite;
  for (const glm::vec3& p : points)
    if (std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z)) finite.push_back(p);
  if (finite.empty()) throw Error("points: none to start from; set `init` to random or to a mesh file");

  Random random(options.seed);
  std::vector<std::uint32_t> chosen = farthest_points(finite, options.farthest_count);
  std::vector<bool> taken(finite.size(), false);
  for (const std::uint32_t k : chosen) taken[k] = true;
  std::vector<std::uint32_t> remaining;
  for (std::uint32_t k = 0; k < finite.size(); ++k)
    if (!taken[k]) remaining.push_back(k);
  random.shuffle(std::span(remaining));
  remaining.resize(std::min(remaining.size(), options.random_count));
  chosen.insert(chosen.end(), remaining.begin(), remaining.end());

  std::vector<glm::vec3> centres;
  for (const std::uint32_t k : chosen) centres.push_back(finite[k]);
  std::vector<double> nearest = nearest_distances(centres, 1);
  const double spacing = std::accumulate(nearest.begin(), nearest.end(), 0.0) / static_cast<double>(nearest.size());
  if (!(spacing > 0))
    throw Error("points: all {} chosen points coincide; set `init` to random or to a mesh file", centres.size());
  std::vector<double> spacings(centres.size(), spacing);
  std::nth_element(nearest.begin(), nearest.begin() + static_cast<std::ptrdiff_t>(nearest.size() / 2), nearest.end());
  if (spacing > options.uneven * nearest[nearest.size() / 2]) {
    spacings = nearest_distances(centres, 3);
    for (double& own : spacings) own *= options.uneven_size;
  }
  std::vector<glm::vec3> triangles;
  triangles.reserve(3 * centres.size());
  for (std::size_t i = 0; i < centres.size(); ++i)
    append(triangles, equilateral_triangle(centres[i], options.radius_per_spacing * spacings[i], random.rotation()));
  return triangles;
}

std::vector<glm::vec3> triangles_in_box(std::size_t count, const glm::vec3& low, const glm::vec3& high,
                                        double circumradius, std::uint64_t seed) {
  Random random(seed);
  std::vector<glm::vec3> triangles;
  triangles.reserve(3 * count);
  for (std::size_t k = 0; k < count; ++k) {
    glm::vec3 centre;
    for (int axis = 0; axis < 3; ++axis) centre[axis] = random.uniform(low[axis], high[axis]);
    append(triangles, equilateral_triangle(centre, circumradius, random.rotation()));
  }
  return triangles;
}

std::vector<glm::vec3> triangles_from_mesh(const Mesh& mesh, std::size_t budget) {
  check_mesh(mesh, "mesh");
  const Mesh decimated = decimate(mesh, budget);
  if (decimated.indices.empty())
    throw Error("mesh: has no triangles with an area, or none that can be reduced to {} triangles; use another mesh",
                budget);
  std::vector<glm::vec3> triangles;
  triangles.reserve(decimated.indices.size());
  for (const std::uint32_t index : decimated.indices) triangles.push_back(decimated.positions[index]);
  return triangles;
}

}  // namespace trisoup::soup
