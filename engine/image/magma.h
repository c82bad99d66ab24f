// The colour map magma of matplotlib (Smith and van der Walt, CC0), black over purple to light yellow, to within 3 of
// 255.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include <glm/glm.hpp>

namespace trisoup {

/// Colour of a value, clamped to 0..1; NaN is black.
inline glm::u8vec3 magma(float value) {
  static constexpr std::array<glm::vec3, 17> kStops{{{0, 0, 4},
                                                     {10, 8, 34},
                                                     {29, 17, 70},
                                                     {54, 16, 106},
                                                     {80, 18, 124},
                                                     {105, 28, 129},
                                                     {130, 38, 129},
                                                     {156, 46, 127},
                                                     {182, 55, 121},
                                                     {207, 65, 112},
                                                     {230, 81, 99},
                                                     {245, 105, 92},
                                                     {251, 135, 97},
                                                     {254, 165, 113},
                                                     {254, 195, 135},
                                                     {253, 224, 162},
                                                     {252, 253, 191}}};
  const float at = value > 0 ? 16 * std::min(value, 1.0f) : 0.0f;
  const auto stop = std::min<std::size_t>(static_cast<std::size_t>(at), 15);
  return glm::u8vec3(glm::round(glm::mix(kStops[stop], kStops[stop + 1], at - static_cast<float>(stop))));
}

}  // namespace trisoup
