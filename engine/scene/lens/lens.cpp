#include "scene/lens/lens.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace trisoup::scene {
namespace {

template <typename Values>
bool all_zero(const Values& values) {
  return std::all_of(values.begin(), values.end(), [](double k) { return k == 0; });
}

bool is_fisheye(Lens::Model model) { return model == Lens::Model::fisheye || model == Lens::Model::fisheye_624; }

double field_of_view_radius(double omega, double r) {
  // The limit for small omega; the next term is of the order omega^2.
  return std::abs(omega) < 1e-7 ? r : std::atan(2 * r * std::tan(0.5 * omega)) / omega;
}

// The smaller solution of k r q^2 - q + r = 0, in the form that is exact for small k.
double division_radius(double k, double r) { return 2 * r / (1 + std::sqrt(1 - 4 * k * r * r)); }

double unified_radius(double alpha, double beta, double r) {
  return r / (alpha * std::sqrt(beta * r * r + 1) + 1 - alpha);
}

// Solves theta = q (1 + k1 q + ... + k4 q^4) for the smallest q by bisection of the first interval that contains it.
double f_theta_radius(const std::array<double, 4>& k, double theta) {
  const auto angle = [&](double q) { return q * (1 + q * (k[0] + q * (k[1] + q * (k[2] + q * k[3])))); };
  constexpr double step = 0.02, farthest = 8;  // radians of an ideal lens
  double low = 0, high = 0;
  while (high < farthest && !(angle(high) >= theta)) {
    low = high;
    high += step;
    if (!(angle(high) > angle(low))) return std::numeric_limits<double>::quiet_NaN();  // the polynomial turns back
  }
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (angle(middle) < theta ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

// Returns what tangential and prism distortion add to the point.
glm::dvec2 decentring(const Lens& lens, glm::dvec2 point) {
  const double s = glm::dot(point, point), xy = point.x * point.y;
  return {2 * lens.p1 * xy + lens.p2 * (s + 2 * point.x * point.x) + s * (lens.prism[0] + s * lens.prism[1]),
          lens.p1 * (s + 2 * point.y * point.y) + 2 * lens.p2 * xy + s * (lens.prism[2] + s * lens.prism[3])};
}

}  // namespace

bool Lens::is_pinhole() const {
  if (model == Model::perspective) return all_zero(radial) && all_zero(denominator) && p1 == 0 && p2 == 0;
  const bool linear_at_zero = model == Model::field_of_view || model == Model::division || model == Model::unified;
  return linear_at_zero && radial[0] == 0;
}

double Lens::distort_radius(double r) const {
  if (model == Model::field_of_view) return field_of_view_radius(radial[0], r);
  if (model == Model::division) return division_radius(radial[0], r);
  if (model == Model::unified) return unified_radius(radial[0], radial[1], r);
  if (model == Model::f_theta) return f_theta_radius(radial, std::atan(r));
  const double angle = is_fisheye(model) ? std::atan(r) : r, s = angle * angle;
  const double numerator =
      1 + s * (radial[0] + s * (radial[1] + s * (radial[2] + s * (radial[3] + s * (high[0] + s * high[1])))));
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
  } else if (model == Model::fisheye && (p1 != 0 || p2 != 0 || !all_zero(prism))) {
    distorted += decentring(*this, r > 1e-12 ? point * (std::atan(r) / r) : point);
  } else if (model == Model::fisheye_624) {
    distorted += decentring(*this, distorted);
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

std::optional<double> Lens::folds_at() const {
  constexpr int steps = 1780;  // of a twentieth of a degree
  constexpr double step = 3.14159265358979323846 / 3600;
  double before = 0;
  for (int i = 1; i <= steps; ++i) {
    const double here = distort_radius(std::tan(step * i));
    if (!(here > before)) return before;
    before = here;
  }
  return std::nullopt;
}

std::string_view model_name(const Lens& lens) {
  switch (lens.model) {
    case Lens::Model::perspective:
      return lens.is_pinhole() ? "PINHOLE" : all_zero(lens.denominator) ? "OPENCV" : "FULL_OPENCV";
    case Lens::Model::fisheye:
      return lens.p1 == 0 && lens.p2 == 0 && all_zero(lens.prism) ? "OPENCV_FISHEYE" : "THIN_PRISM_FISHEYE";
    case Lens::Model::fisheye_624:
      return "RAD_TAN_THIN_PRISM_FISHEYE";
    case Lens::Model::field_of_view:
      return "FOV";
    case Lens::Model::division:
      return "DIVISION";
    case Lens::Model::unified:
      return "EUCM";
    case Lens::Model::f_theta:
      return "FTHETA";
    case Lens::Model::equirectangular:
      return "EQUIRECTANGULAR";
  }
  return "";
}

void add_lens(Fingerprint& fingerprint, const Lens& lens) {
  fingerprint.add(static_cast<int>(lens.model));
  for (const double value : lens.radial) fingerprint.add(value);
  for (const double value : lens.denominator) fingerprint.add(value);
  fingerprint.add(lens.p1), fingerprint.add(lens.p2);
  // Checkpoints of lenses without these coefficients keep their fingerprint.
  if (all_zero(lens.high) && all_zero(lens.prism)) return;
  for (const double value : lens.high) fingerprint.add(value);
  for (const double value : lens.prism) fingerprint.add(value);
}

}  // namespace trisoup::scene
