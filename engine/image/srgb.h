// The transfer function of sRGB (IEC 61966-2-1): display values and light, both 0..1.
#pragma once

#include <cmath>

namespace trisoup {

inline double light_of_srgb(double display) {
  return display <= 0.04045 ? display / 12.92 : std::pow((display + 0.055) / 1.055, 2.4);
}
inline double srgb_of_light(double light) {
  return light <= 0.0031308 ? 12.92 * light : 1.055 * std::pow(light, 1 / 2.4) - 0.055;
}
/// Derivative of light_of_srgb.
inline double light_slope(double display) {
  return display <= 0.04045 ? 1 / 12.92 : 2.4 / 1.055 * std::pow((display + 0.055) / 1.055, 1.4);
}

}  // namespace trisoup
