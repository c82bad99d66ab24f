// Which triangles lie in boxes and spheres.
#pragma once

#include <array>
#include <vector>

#include <glm/glm.hpp>

namespace trisoup::soup {

struct CropBox {
  glm::dvec3 low{0.0}, high{0.0};
};
struct CropSphere {
  glm::dvec3 centre{0.0};
  double radius = 0;
};
/// The union of its boxes and spheres.
struct CropRegion {
  std::vector<CropBox> boxes;
  std::vector<CropSphere> spheres;
  bool empty() const { return boxes.empty() && spheres.empty(); }
};

/// Which triangles across a border are held: all, those whose centroid is inside, or none.
enum class Across { keep, centroid, drop };

/// Whether a box or sphere holds the triangle. Borders belong to both.
bool holds(const CropRegion& region, const std::array<glm::dvec3, 3>& triangle, Across across);

}  // namespace trisoup::soup
