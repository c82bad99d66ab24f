#include "mesh/inner_box.h"

#include <algorithm>
#include <cstddef>
#include <vector>

namespace trisoup::soup {

Box inner_box(std::span<const glm::vec3> vertices, double left_out) {
  Box box;
  if (vertices.empty()) return box;
  std::vector<float> values(vertices.size());
  for (int axis = 0; axis < 3; ++axis) {
    std::transform(vertices.begin(), vertices.end(), values.begin(), [axis](const glm::vec3& v) { return v[axis]; });
    // The same number is left out at each end; none if there are few vertices.
    const auto left = static_cast<std::ptrdiff_t>(left_out * static_cast<double>(values.size() - 1));
    const auto low = values.begin() + left, high = values.end() - 1 - left;
    std::nth_element(values.begin(), low, values.end());
    box.low[axis] = *low;
    std::nth_element(values.begin(), high, values.end());
    box.high[axis] = *high;
  }
  return box;
}

}  // namespace trisoup::soup
