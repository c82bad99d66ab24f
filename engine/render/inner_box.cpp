#include "render/inner_box.h"

#include <algorithm>
#include <cstddef>
#include <vector>

namespace trisoup::render {

Box inner_box(std::span<const glm::vec3> vertices, double left_out) {
  Box box;
  if (vertices.empty()) return box;
  std::vector<float> values(vertices.size());
  for (int axis = 0; axis < 3; ++axis) {
    std::transform(vertices.begin(), vertices.end(), values.begin(), [axis](const glm::vec3& v) { return v[axis]; });
    const auto quantile = [&](double q) {
      const auto at = values.begin() + static_cast<std::ptrdiff_t>(q * static_cast<double>(values.size() - 1));
      std::nth_element(values.begin(), at, values.end());
      return *at;
    };
    box.low[axis] = quantile(left_out);
    box.high[axis] = quantile(1.0 - left_out);
  }
  return box;
}

}  // namespace trisoup::render
