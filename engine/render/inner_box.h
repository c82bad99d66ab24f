// The box that most vertices of a soup lie in. Soups have strays, which a box around all of them would follow.
#pragma once

#include <span>

#include <glm/glm.hpp>

namespace trisoup::render {

struct Box {
  glm::vec3 low{0.0f}, high{0.0f};
};

/// From the `left_out` quantile (0 to 0.5) of the vertices' coordinates to the 1 - left_out one, axis by axis. At the origin where there are none.
Box inner_box(std::span<const glm::vec3> vertices, double left_out);

}  // namespace trisoup::render
