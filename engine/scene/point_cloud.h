// Sparse points as the readers return them.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include <glm/glm.hpp>

namespace trisoup::scene {

/// Points in the coordinates of the file, before normalisation.
struct PointCloud {
  std::vector<glm::dvec3> positions;
  std::vector<glm::u8vec3> colours;  // same length, or empty
  std::vector<float> errors;         // of reprojection, pixels; same length, or empty; negative: not known
  // Views in which the point was observed, ascending, no view twice; same length, or empty. COLMAP's readers have image
  // ids here, Dataset has indices of its frames, Scene those of its training views.
  std::vector<std::vector<std::uint32_t>> seen_by;

  /// A point of a cloud that knows all of it. track: in any order; error: what is no number of pixels is not known.
  void add(const glm::dvec3& position, const glm::u8vec3& colour, double error, std::vector<std::uint32_t> track);
};

/// `views` by other numbers, ascending; those that `to` does not have are left out.
void renumber(std::vector<std::uint32_t>& views, const std::map<std::uint32_t, std::uint32_t>& to);

}  // namespace trisoup::scene
