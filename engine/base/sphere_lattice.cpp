#include "base/sphere_lattice.h"

#include <cmath>

namespace trisoup {

glm::dvec3 sphere_lattice(int i, int count) {
  constexpr double kGoldenAngle = 2.399963229728653;
  const double z = 1.0 - (2.0 * i + 1.0) / count, r = std::sqrt(1.0 - z * z);
  return {r * std::cos(i * kGoldenAngle), r * std::sin(i * kGoldenAngle), z};
}

}  // namespace trisoup
