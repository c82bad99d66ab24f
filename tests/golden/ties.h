// Ties: pixels that may show either of two triangles, and hidden MLP units at zero, where rounding decides. Computes
// from a case's inputs, in double, by how much two correct programs may differ, with bounds for the rounding error of
// float programs.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace trisoup::test {

/// A value and the error bound of the same formula in floats. Every operation has an independent error of at most the
/// unit roundoff, so squared errors add up (probabilistic running error analysis: Higham and Mary, A New Approach to
/// Probabilistic Rounding Error Analysis, 2019). The root mean square error of an operation is two fifths of that, so
/// bound() is more than seven standard deviations. An infinite error means that the value is unknown.
struct Rounded {
  double value = 0, error = 0;
  double bound() const { return 3 * error; }
  bool surely_negative() const { return value + bound() < 0; }
  bool surely_positive() const { return value - bound() > 0; }
};
Rounded operator+(Rounded a, Rounded b);
Rounded operator-(Rounded a, Rounded b);
Rounded operator*(Rounded a, Rounded b);
Rounded operator/(Rounded a, Rounded b);

/// One view of a soup as the published method renders it: per pixel, opacities against thresholds, without triangles
/// that reach behind the camera.
struct SeenSoup {
  std::span<const float> clip_from_world;  // [4][4], row-major
  std::span<const float> vertices;         // [n][3]
  std::span<const std::int32_t> faces;     // [triangles][3]
  std::span<const float> opacity;          // [triangles][samples of the level], 0..1
  std::uint32_t level = 0, width = 0, height = 0;
  /// [height][width]: index + 1 of the triangle that each pixel is assumed to show, or 0.
  std::span<const std::uint32_t> shown;
  std::span<const float> thresholds = {};  // [height][width][triangles]; empty: 0.5
};

struct VisibilityTies {
  /// Per pixel, rows from NDC y = -1 on: index + 1 of every triangle that it may show, or 0. A single entry is no tie.
  std::vector<std::vector<std::uint32_t>> winners;
  /// Per triangle: rounding decides at some pixel whether it covers it, is opaque there, or is in front of the visible
  /// triangle.
  std::vector<bool> triangles;
  /// Per pixel: combined error (Rounded) of the barycentrics of the visible fragment.
  std::vector<double> place_errors;

  bool tied(std::size_t pixel) const { return winners[pixel].size() > 1; }
  bool may_show(std::size_t pixel, std::uint32_t winner) const;
};
VisibilityTies visibility_ties(const SeenSoup& soup);

/// Comparison of a picture with SeenSoup::shown.
struct Settlement {
  std::vector<std::size_t> otherwise;  // different pixels that are ties
  std::size_t wrong = 0;               // different pixels that are not
};
/// drawn: like SeenSoup::shown, from another program.
Settlement settle(const VisibilityTies& ties, std::span<const std::uint32_t> shown,
                  std::span<const std::uint32_t> drawn);

/// Effect of the MLP's hidden units at zero at one pixel; 0 if none is tied.
struct HiddenTies {
  int units = 0;  // number of tied units; above kMost nothing is computed or allowed
  static constexpr int kMost = 8;
  /// [MLP_COUNT]: largest difference of the parameters' gradients between two choices; empty: zero.
  std::vector<double> parameters;
  std::array<double, 7> features{};  // the same for the gradient of the pixel's features
};
/// parameters: in the order of soup::Mlp. x: the pixel's 16 inputs; the fourth is the residual weight. colour_gradient:
/// gradient of the loss with respect to the pixel's colour.
HiddenTies hidden_ties(std::span<const float> parameters, std::span<const Rounded> x,
                       std::span<const float> colour_gradient);
/// A value interpolated from samples of a level whose values differ by up to `spread`, at a position with this error.
Rounded mixed(double value, double spread, std::uint32_t level, double place_error);
/// A component of a direction, or a function of it: a normalised difference of two points.
Rounded of_direction(double value);

/// Result of comparing an array with its expected values.
struct Compared {
  bool holds = false;
  double relative = 0;  // largest difference beyond the allowance, divided by the largest magnitude of `expected`
  double largest = 0;
  std::size_t worst = 0;                  // index of the largest difference
  std::size_t left_out = 0, allowed = 0;  // number of skipped elements, and of elements with an allowance
};
/// skip: elements to leave out (empty: none). allowance: per element, permitted difference in addition to `tolerance`
/// times the largest magnitude (empty: none).
Compared compare(std::span<const float> actual, std::span<const float> expected, double tolerance,
                 const std::vector<bool>& skip = {}, std::span<const double> allowance = {});

/// Maximum number of triangles whose gradients may be left out for ties: a fifth, at least three. More would invalidate
/// the case.
std::size_t most_tied_triangles(std::size_t triangles);

}  // namespace trisoup::test
