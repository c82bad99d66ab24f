#include "scene/lens.h"

#include <algorithm>
#include <cmath>

namespace trisoup::scene {

bool Lens::is_pinhole() const {
  const auto zero = [](double k) { return k == 0; };
  return model == Model::perspective && std::all_of(radial.begin(), radial.end(), zero) &&
         std::all_of(denominator.begin(), denominator.end(), zero) && p1 == 0 && p2 == 0;
}

double Lens::distort_radius(double r) const {
  const double angle = model == Model::fisheye ? std::atan(r) : r, s = angle * angle;
  const double numerator = 1 + s * (radial[0] + s * (radial[1] + s * (radial[2] + s * radial[3])));
  const double divisor = 1 + s * (denominator[0] + s * (denominator[1] + s * denominator[2]));
  return angle * numerator / divisor;
}

glm::dvec2 Lens::distort(glm::dvec2 point) const {
  const double r = glm::length(point);
  glm::dvec2 distorted = r > 1e-12 ? point * (distort_radius(r) / r) : point;
  if (model == Model::perspective) {
    const double xy = point.x * point.y;
    distorted.x += 2 * p1 * xy + p2 * (r * r + 2 * point.x * point.x);
    distorted.y += p1 * (r * r + 2 * point.y * point.y) + 2 * p2 * xy;
  }
  return distorted;
}

double Lens::growing_until(double largest) const {
  // About as fine as the pixels of a photograph. The limit usually lies outside the source image, so this is enough.
  constexpr int steps = 2000;
  double before = 0;
  for (int i = 1; i <= steps; ++i) {
    const double r = largest * i / steps, here = distort_radius(r);
    if (!(here > before)) return largest * (i - 1) / steps;
    before = here;
  }
  return largest;
}

}  // namespace trisoup::scene
