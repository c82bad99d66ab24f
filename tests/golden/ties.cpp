#include "golden/ties.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/host.h"

namespace trisoup::test {
namespace {

constexpr double kUnit = 0x1p-24;  // relative rounding error of a float
constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// Error of values up to one from a sigmoid or a normalisation: a few rounding errors.
constexpr double kOfOne = 0x1p-22;

Rounded rounded(double value, double error) {
  if (!std::isfinite(value) || !std::isfinite(error)) return {0, kInfinity};
  return {value, std::hypot(error, kUnit * value)};
}
Rounded exact(double value) { return {value, 0}; }

using Point = std::array<Rounded, 4>;  // clip coordinates x, y, z, w

Point project(std::span<const float> m, const float* v) {
  Point p;
  for (int r = 0; r < 4; ++r)
    p[r] = exact(m[4 * r]) * exact(v[0]) + exact(m[4 * r + 1]) * exact(v[1]) + exact(m[4 * r + 2]) * exact(v[2]) +
           exact(m[4 * r + 3]);
  return p;
}

enum class Certain { no, perhaps, yes };
Certain both(Certain a, Certain b) { return std::min(a, b); }
Certain at_least_zero(Rounded a) {
  return a.surely_negative() ? Certain::no : a.value - a.bound() >= 0 ? Certain::yes : Certain::perhaps;
}
/// Whether a triangle is drawn at all: no corner at or behind the camera, and not all corners outside the same plane.
Certain drawn(const std::array<Point, 3>& p) {
  Certain in = Certain::yes;
  for (const Point& corner : p) {
    if (corner[3].value + corner[3].bound() <= 0) return Certain::no;
    if (!corner[3].surely_positive()) in = Certain::perhaps;
  }
  for (int axis = 0; axis < 3; ++axis)
    for (const double sign : {-1.0, 1.0}) {
      Certain outside = Certain::yes;
      for (const Point& corner : p) outside = both(outside, at_least_zero(exact(sign) * corner[axis] - corner[3]));
      // A corner on the plane is not outside, but one rounding error away from it.
      if (outside == Certain::yes) return Certain::no;
      if (outside == Certain::perhaps) in = Certain::perhaps;
    }
  return in;
}

/// A triangle at a pixel.
struct Fragment {
  std::uint32_t triangle = 0;
  Certain there = Certain::no;  // it covers the pixel, between the near and the far plane
  Certain kept = Certain::no;   // and its opacity reaches the threshold
  Rounded depth;
  double place_error = 0;
};

/// Perspective-correct barycentrics with the published test: b0 >= 0, b1 >= 0, b0 + b1 <= 1.
struct Place {
  Certain inside = Certain::no;
  Rounded b0, b1;
};
Place place(const std::array<Point, 3>& p, double x, double y) {
  std::array<std::array<Rounded, 2>, 3> q;
  for (int i = 0; i < 3; ++i)
    for (int axis = 0; axis < 2; ++axis)
      q[i][axis] = p[i][axis] - rounded(axis ? y : x, kUnit * std::abs(axis ? y : x)) * p[i][3];
  const auto cross = [&](int i, int j) { return q[i][0] * q[j][1] - q[i][1] * q[j][0]; };
  const std::array<Rounded, 3> a{cross(1, 2), cross(2, 0), cross(0, 1)};
  const Rounded area = a[0] + a[1] + a[2];
  if (!area.surely_positive() && !area.surely_negative()) {
    // Nearly edge-on. If the pixel's ray has corners on both sides, it misses the triangle for either sign of the area.
    const bool some_positive = std::any_of(a.begin(), a.end(), [](Rounded r) { return r.surely_positive(); });
    const bool some_negative = std::any_of(a.begin(), a.end(), [](Rounded r) { return r.surely_negative(); });
    if (some_positive && some_negative) return {};
    if (area.value == 0 && area.error == 0) return {};
    return {Certain::perhaps, {0, kInfinity}, {0, kInfinity}};
  }
  Place at{Certain::yes, a[0] / area, a[1] / area};
  for (const Rounded b : {at.b0, at.b1, exact(1) - (at.b0 + at.b1)}) at.inside = both(at.inside, at_least_zero(b));
  return at;
}

/// Opacity between lattice points. It is piecewise linear and continuous, so the choice of cell on a cell's edge does
/// not matter.
Rounded opacity_at(std::span<const float> samples, std::uint32_t level, Rounded b0, Rounded b1) {
  const auto [low, high] = std::minmax_element(samples.begin(), samples.end());
  const double spread = double(*high) - *low;
  if (!std::isfinite(b0.error) || !std::isfinite(b1.error)) return {0.5 * (double(*high) + *low), spread + kOfOne};
  const double x = std::clamp(b0.value, 0.0, 1.0), y = std::clamp(b1.value, 0.0, 1.0 - x);
  const f64::LatticeCell cell = f64::lattice_cell(x, y, level);
  const double value = f64::lattice_mix(cell, samples[cell.i0], samples[cell.i1], samples[cell.i2]);
  return mixed(value, spread, level, std::hypot(b0.error, b1.error));
}

}  // namespace

Rounded operator+(Rounded a, Rounded b) { return rounded(a.value + b.value, std::hypot(a.error, b.error)); }
Rounded operator-(Rounded a, Rounded b) { return rounded(a.value - b.value, std::hypot(a.error, b.error)); }
Rounded operator*(Rounded a, Rounded b) {
  return rounded(a.value * b.value, std::hypot(a.value * b.error, b.value * a.error, a.error * b.error));
}
Rounded operator/(Rounded a, Rounded b) {
  const double nearest = std::abs(b.value) - b.bound();
  if (!(nearest > 0)) return {0, kInfinity};
  const double value = a.value / b.value;
  return rounded(value, std::hypot(a.error, value * b.error) / nearest);
}

bool VisibilityTies::may_show(std::size_t pixel, std::uint32_t winner) const {
  return std::find(winners[pixel].begin(), winners[pixel].end(), winner) != winners[pixel].end();
}

VisibilityTies visibility_ties(const SeenSoup& soup) {
  const std::size_t triangles = soup.faces.size() / 3, pixels = std::size_t(soup.width) * soup.height;
  const std::size_t samples = soup.opacity.size() / triangles;
  VisibilityTies ties{std::vector<std::vector<std::uint32_t>>(pixels), std::vector<bool>(triangles),
                      std::vector<double>(pixels)};
  std::vector<std::vector<Fragment>> fragments(pixels);
  for (std::uint32_t t = 0; t < triangles; ++t) {
    std::array<Point, 3> p;
    for (int k = 0; k < 3; ++k)
      p[k] = project(soup.clip_from_world, &soup.vertices[3 * static_cast<std::size_t>(soup.faces[3 * t + k])]);
    const Certain whole = drawn(p);
    if (whole == Certain::no) continue;
    // The pixel range of the triangle, extended by one on every side; all pixels if the position of a corner is
    // unknown.
    double low[2] = {1e30, 1e30}, high[2] = {-1e30, -1e30};
    for (const Point& corner : p)
      for (int axis = 0; axis < 2; ++axis) {
        const Rounded ndc = corner[axis] / corner[3];
        low[axis] = std::min(low[axis], ndc.value - ndc.bound());
        high[axis] = std::max(high[axis], ndc.value + ndc.bound());
      }
    const auto range = [&](int axis, std::uint32_t size) {
      const auto pixel = [&](double ndc) { return std::clamp(0.5 * (ndc + 1) * size - 0.5, -2.0, size + 2.0); };
      return std::pair(static_cast<std::uint32_t>(std::max(0.0, std::floor(pixel(low[axis])) - 1)),
                       static_cast<std::uint32_t>(std::clamp(std::ceil(pixel(high[axis])) + 2, 0.0, double(size))));
    };
    const auto [x0, x1] = range(0, soup.width);
    const auto [y0, y1] = range(1, soup.height);
    for (std::uint32_t y = y0; y < y1; ++y)
      for (std::uint32_t x = x0; x < x1; ++x) {
        const Place at = place(p, -1 + 2 * (x + 0.5) / soup.width, -1 + 2 * (y + 0.5) / soup.height);
        if (at.inside == Certain::no) continue;
        const Rounded b2 = exact(1) - at.b0 - at.b1;
        const auto mix = [&](int axis) { return at.b0 * p[0][axis] + at.b1 * p[1][axis] + b2 * p[2][axis]; };
        Fragment f{t, both(whole, at.inside), Certain::no, mix(2) / mix(3), std::hypot(at.b0.error, at.b1.error)};
        f.there = both(f.there, both(at_least_zero(f.depth + exact(1)), at_least_zero(exact(1) - f.depth)));
        if (f.there == Certain::no) continue;
        const std::size_t pixel = std::size_t(y) * soup.width + x;
        const Rounded opacity = opacity_at(soup.opacity.subspan(t * samples, samples), soup.level, at.b0, at.b1);
        const double threshold = soup.thresholds.empty() ? 0.5 : soup.thresholds[pixel * triangles + t];
        const Certain passes = at_least_zero({opacity.value - threshold, opacity.error});
        f.kept = both(f.there, passes);
        if (f.there == Certain::perhaps || passes == Certain::perhaps) ties.triangles[t] = true;
        f.depth.error = std::hypot(f.depth.error, kUnit);  // the compared value is depth + 2, rounded to a float
        fragments[pixel].push_back(f);
      }
  }
  for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
    double farthest = kInfinity;  // nothing behind it can be visible
    for (const Fragment& f : fragments[pixel])
      if (f.kept == Certain::yes) farthest = std::min(farthest, f.depth.value + f.depth.bound());
    std::vector<std::uint32_t>& winners = ties.winners[pixel];
    for (const Fragment& f : fragments[pixel])
      if (f.kept != Certain::no && f.depth.value - f.depth.bound() <= farthest) winners.push_back(f.triangle + 1);
    if (farthest == kInfinity) winners.push_back(0);
    // Opacity gradients depend on which fragments are in front of the visible one, and edge forces on which of two is.
    const std::vector<Fragment>& all = fragments[pixel];
    const auto shown =
        std::find_if(all.begin(), all.end(), [&](const Fragment& f) { return f.triangle + 1 == soup.shown[pixel]; });
    if (shown == all.end()) continue;
    ties.place_errors[pixel] = shown->place_error;
    for (const Fragment& f : all)
      if (f.triangle != shown->triangle &&
          std::abs(f.depth.value - shown->depth.value) <= f.depth.bound() + shown->depth.bound())
        ties.triangles[f.triangle] = true;
  }
  return ties;
}

Settlement settle(const VisibilityTies& ties, std::span<const std::uint32_t> shown,
                  std::span<const std::uint32_t> drawn) {
  Settlement settlement;
  for (std::size_t p = 0; p < shown.size(); ++p) {
    if (drawn[p] == shown[p]) continue;
    if (ties.may_show(p, shown[p]) && ties.may_show(p, drawn[p]))
      settlement.otherwise.push_back(p);
    else
      ++settlement.wrong;
  }
  return settlement;
}

Rounded mixed(double value, double spread, std::uint32_t level, double place_error) {
  // One lattice step along b0 or b1 changes the value by at most the spread. Weights are differences of numbers as
  // large as 2^level.
  const double steps = double(1u << level) * (place_error + 2 * kUnit);
  return {value, std::hypot(std::min(1.0, steps) * spread, kOfOne)};
}

Rounded of_direction(double value) { return {value, kOfOne}; }

HiddenTies hidden_ties(std::span<const float> parameters, std::span<const Rounded> x,
                       std::span<const float> colour_gradient) {
  constexpr int kWidth = 16;
  HiddenTies ties;
  std::array<Rounded, kWidth> in, sum[2];
  std::copy_n(x.begin(), kWidth, in.begin());
  std::vector<int> tied;  // layer * 16 + unit
  std::array<bool, 2 * kWidth> on{};
  for (const int layer : {0, 1}) {
    for (int o = 0; o < kWidth; ++o) {
      Rounded s = exact(parameters[(layer ? MLP_B2 : MLP_B1) + o]);
      for (int i = 0; i < kWidth; ++i) s = s + exact(parameters[(layer ? MLP_W2 : 0) + o * kWidth + i]) * in[i];
      sum[layer][o] = s;
      on[layer * kWidth + o] = s.value > 0;
      if (std::abs(s.value) <= s.bound()) tied.push_back(layer * kWidth + o);
    }
    for (int i = 0; i < kWidth; ++i) in[i] = {std::max(0.0, sum[layer][i].value), sum[layer][i].error};
  }
  ties.units = static_cast<int>(tied.size());
  if (tied.empty() || ties.units > HiddenTies::kMost) return ties;

  // The gradients of all combinations of choices.
  std::vector<double> low(MLP_COUNT, kInfinity), high(MLP_COUNT, -kInfinity);
  std::array<double, 7> feature_low, feature_high;
  feature_low.fill(kInfinity);
  feature_high.fill(-kInfinity);
  for (unsigned choice = 0; choice < 1u << tied.size(); ++choice) {
    for (std::size_t k = 0; k < tied.size(); ++k) on[static_cast<std::size_t>(tied[k])] = choice >> k & 1u;
    // A hidden unit at zero outputs zero with either choice.
    std::array<double, kWidth> h[2];
    for (const int layer : {0, 1})
      for (int i = 0; i < kWidth; ++i) h[layer][i] = std::max(0.0, sum[layer][i].value);
    std::vector<double> g(MLP_COUNT, 0.0);
    std::array<double, kWidth> d2{}, d1{};
    for (int c = 0; c < 3; ++c) {
      double z = parameters[MLP_B3 + c];
      for (int i = 0; i < kWidth; ++i) z += double(parameters[MLP_W3 + c * kWidth + i]) * h[1][i];
      const double y = 1 / (1 + std::exp(-z)), d = double(colour_gradient[c]) * x[3].value * y * (1 - y);
      g[MLP_B3 + c] = d;
      for (int i = 0; i < kWidth; ++i) {
        g[MLP_W3 + c * kWidth + i] = d * h[1][i];
        d2[i] += on[kWidth + i] ? d * parameters[MLP_W3 + c * kWidth + i] : 0.0;
      }
    }
    for (int o = 0; o < kWidth; ++o) {
      g[MLP_B2 + o] = d2[o];
      for (int i = 0; i < kWidth; ++i) {
        g[MLP_W2 + o * kWidth + i] = d2[o] * h[0][i];
        d1[i] += on[i] ? d2[o] * parameters[MLP_W2 + o * kWidth + i] : 0.0;
      }
    }
    std::array<double, 7> feature{};
    for (int o = 0; o < kWidth; ++o) {
      g[MLP_B1 + o] = d1[o];
      for (int i = 0; i < kWidth; ++i) g[o * kWidth + i] = d1[o] * x[i].value;
      for (int i = 0; i < 7; ++i) feature[i] += d1[o] * parameters[o * kWidth + i];
    }
    for (std::size_t i = 0; i < g.size(); ++i) low[i] = std::min(low[i], g[i]), high[i] = std::max(high[i], g[i]);
    for (int i = 0; i < 7; ++i)
      feature_low[i] = std::min(feature_low[i], feature[i]), feature_high[i] = std::max(feature_high[i], feature[i]);
  }
  for (std::size_t i = 0; i < low.size(); ++i) ties.parameters.push_back(high[i] - low[i]);
  for (int i = 0; i < 7; ++i) ties.features[i] = feature_high[i] - feature_low[i];
  return ties;
}

Compared compare(std::span<const float> actual, std::span<const float> expected, double tolerance,
                 const std::vector<bool>& skip, std::span<const double> allowance) {
  Compared c;
  double difference = 0;
  bool finite = true;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    c.largest = std::max(c.largest, std::abs(double(expected[i])));
    if (!skip.empty() && skip[i]) {
      ++c.left_out;
      continue;
    }
    finite = finite && std::isfinite(actual[i]);
    const double allowed = allowance.empty() ? 0.0 : allowance[i];
    c.allowed += allowed > 0;
    const double d = std::abs(double(actual[i]) - expected[i]) - allowed;
    if (d > difference) difference = d, c.worst = i;
  }
  c.relative = c.largest > 0 ? difference / c.largest : difference;
  c.holds = finite && c.relative <= tolerance;
  return c;
}

std::size_t most_tied_triangles(std::size_t triangles) { return std::max<std::size_t>(triangles / 5, 3); }

}  // namespace trisoup::test
