// Sparse points as returned by the readers.
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
  std::vector<float> errors;         // reprojection errors in pixels; same length, or empty; negative: unknown
  /// Views that observed the point, ascending, without duplicates; same length, or empty. The numbers are image ids in
  /// COLMAP's readers, indices of frames in Dataset, and indices of training views in Scene.
  std::vector<std::vector<std::uint32_t>> seen_by;

  /// Adds a point to a cloud that has all attributes. error: pixels; invalid values become unknown. track: views in any
  /// order.
  void add(const glm::dvec3& position, const glm::u8vec3& colour, double error, std::vector<std::uint32_t> track);
};

/// Removes seen_by if no point has a view there: files of converters often have no tracks, which is not the same as
/// points that no view saw.
void drop_empty_tracks(PointCloud& cloud);

/// Replaces each view by its number in `to`, in ascending order. Removes views that are not in `to`.
void renumber(std::vector<std::uint32_t>& views, const std::map<std::uint32_t, std::uint32_t>& to);

}  // namespace trisoup::scene
