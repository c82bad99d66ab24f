// Sparse points as the readers return them.
#pragma once

#include <vector>

#include <glm/glm.hpp>

namespace trisoup::scene {

/// Points in the coordinates of the file, before normalisation.
struct PointCloud {
  std::vector<glm::dvec3> positions;
  std::vector<glm::u8vec3> colours;  // same length, or empty
};

}  // namespace trisoup::scene
