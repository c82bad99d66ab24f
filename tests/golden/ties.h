// Where rounding decides: pixels that may show one triangle or another, hidden units of the MLP at zero, and what two
// right programs may differ by for it. Found from a case's inputs, in double, with bounds of what a float program's
// rounding moves.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace trisoup::test {

/// A value and how far the same formula in floats comes out from it: every operation errs by at most the unit roundoff,
/// independently of the others, so that their squares add up (probabilistic running error analysis: Higham and Mary, A
/// New Approach to Probabilistic Rounding Error Analysis, 2019). An operation's root mean square error is two fifths of
/// that, so bound() is more than seven deviations. Infinite: nothing is known.
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

/// One view of a soup, as the published method sees it (drawn pixel by pixel, opacities against thresholds, triangles
/// behind the camera left out).
struct SeenSoup {
  std::span<const float> clip_from_world;  // [4][4], rows
  std::span<const float> vertices;         // [n][3]
  std::span<const std::int32_t> faces;     // [triangles][3]
  std::span<const float> opacity;          // [triangles][samples of the level], 0..1
  std::uint32_t level = 0, width = 0, height = 0;
  std::span<const std::uint32_t>
      shown;  // [height][width], index + 1 of the triangle that each pixel is taken to show, 0 for none
  std::span<const float> thresholds = {};  // [height][width][triangles]; empty: a half
};

struct VisibilityTies {
  /// Per pixel, rows from NDC y = -1 on: index + 1 of every triangle that it may show, 0 for none. One: no tie.
  std::vector<std::vector<std::uint32_t>> winners;
  /// Per triangle: somewhere rounding decides whether it covers a pixel, is opaque there, or lies in front of what is
  /// shown.
  std::vector<bool> triangles;
  /// Per pixel: error (Rounded) of the barycentrics at which it looks at the triangle that is shown, together.
  std::vector<double> place_errors;

  bool tied(std::size_t pixel) const { return winners[pixel].size() > 1; }
  bool may_show(std::size_t pixel, std::uint32_t winner) const;
};
VisibilityTies visibility_ties(const SeenSoup& soup);

/// A picture whose pixels show other triangles than SeenSoup::shown.
struct Settlement {
  std::vector<std::size_t> otherwise;  // pixels where either may be shown
  std::size_t wrong = 0;               // pixels where it may not
};
/// drawn: as SeenSoup::shown, of another program.
Settlement settle(const VisibilityTies& ties, std::span<const std::uint32_t> shown,
                  std::span<const std::uint32_t> drawn);

/// What the MLP's hidden units at zero may change at one pixel: 0 where none is tied.
struct HiddenTies {
  int units = 0;  // tied; more than kMost are not looked into, and allow for nothing
  static constexpr int kMost = 8;
  std::vector<double>
      parameters;  // [595] of the gradients of the parameters: the most that two choices differ by; empty: zero
  std::array<double, 7> features{};  // the same, of the gradient of the pixel's features
};
/// parameters: soup::Mlp's order. x: the pixel's 16 inputs, the fourth of them its residual weight. colour_gradient: of
/// the loss with respect to its colour.
HiddenTies hidden_ties(std::span<const float> parameters, std::span<const Rounded> x,
                       std::span<const float> colour_gradient);
/// A value that is mixed from samples of a level, which lie between two values `spread` apart, at a place with that
/// error.
Rounded mixed(double value, double spread, std::uint32_t level, double place_error);
/// A component of a direction or of what is made of it: of a difference of two points, normalised.
Rounded of_direction(double value);

/// An array held against what it should be.
struct Compared {
  bool holds = false;
  double relative = 0;  // largest difference, less what ties allow for it, over the largest magnitude of `expected`
  double largest = 0;
  std::size_t worst = 0;                  // where that is
  std::size_t left_out = 0, allowed = 0;  // elements left out, and that ties allow something for
};
/// skip: elements left out (empty: none). allowance: what an element may differ by besides `tolerance` of the largest
/// (empty: nothing).
Compared compare(std::span<const float> actual, std::span<const float> expected, double tolerance,
                 const std::vector<bool>& skip = {}, std::span<const double> allowance = {});

/// Ties must not excuse a case: of so many triangles gradients may be left out, a fifth, and three of few.
std::size_t most_tied_triangles(std::size_t triangles);

}  // namespace trisoup::test
