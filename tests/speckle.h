// A texture for tests that compare photographs.
#pragma once

#include <cmath>
#include <cstdint>

namespace trisoup::test {

/// A non-repeating texture: interpolated hash values on a grid of side 1; 0 to 255.
inline double speckle(double x, double y) {
  const auto value = [](int i, int j) {
    std::uint32_t h = static_cast<std::uint32_t>(i) * 374761393u + static_cast<std::uint32_t>(j) * 668265263u;
    h = (h ^ (h >> 13)) * 1274126177u;
    return double((h ^ (h >> 16)) & 255u);
  };
  const double fx = x - std::floor(x), fy = y - std::floor(y);
  const int i = int(std::floor(x)), j = int(std::floor(y));
  return (1 - fy) * ((1 - fx) * value(i, j) + fx * value(i + 1, j)) +
         fy * ((1 - fx) * value(i, j + 1) + fx * value(i + 1, j + 1));
}

}  // namespace trisoup::test
