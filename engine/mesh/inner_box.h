// The box that most vertices of a soup lie in. Soups have strays, which a box around all of them would follow.
#pragma once

#include <span>

#include <glm/glm.hpp>

namespace trisoup::soup {

struct Box {
  glm::vec3 low{0.0f}, high{0.0f};
};

/// Axis by axis, without the share `left_out` (0 to 0.5) of the coordinates at either end, rounded down. At the origin
/// where there are no vertices.
Box inner_box(std::span<const glm::vec3> vertices, double left_out);

}  // namespace trisoup::soup
