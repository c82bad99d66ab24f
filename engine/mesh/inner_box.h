// A bounding box of most vertices of a soup. A box around all vertices would follow the strays that soups have.
#pragma once

#include <span>

#include <glm/glm.hpp>

namespace trisoup::soup {

struct Box {
  glm::vec3 low{0.0f}, high{0.0f};
};

/// Returns the box, computed per axis, without the fraction `left_out` (0 to 0.5) of the coordinates at each end,
/// rounded down. Without vertices the box is a point at the origin.
Box inner_box(std::span<const glm::vec3> vertices, double left_out);

}  // namespace trisoup::soup
