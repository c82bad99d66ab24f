// Tests golden/ties.h: differences that rounding can cause are allowed, others are not.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "common/host.h"
#include "golden/ties.h"

using namespace trisoup::test;

namespace {

/// Triangles in clip space with w = 1 on 5 x 5 pixels, whose centres are at -0.8, -0.4, 0, 0.4, 0.8.
struct Flat {
  std::vector<float> matrix{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}, vertices, opacity;
  std::vector<std::int32_t> faces;
  std::vector<std::uint32_t> shown = std::vector<std::uint32_t>(25);
  void add(std::vector<float> corners, float alpha = 0.9f) {
    vertices.insert(vertices.end(), corners.begin(), corners.end());
    for (int k = 0; k < 3; ++k) faces.push_back(static_cast<std::int32_t>(faces.size()));
    for (int k = 0; k < 3; ++k) opacity.push_back(alpha);
  }
  VisibilityTies ties() const { return visibility_ties({matrix, vertices, faces, opacity, 0, 5, 5, shown}); }
};

using Winners = std::vector<std::uint32_t>;

/// A wall at depth 0.25 and a sloping one that intersects it at x = `crossing`.
Flat crossed(float crossing) {
  Flat flat;
  flat.add({-3, -3, 0.25f, 5, -3, 0.25f, -3, 5, 0.25f});
  const auto z = [&](float x) { return 0.25f + 0.125f * (x - crossing); };
  flat.add({-3, -3, z(-3), 5, -3, z(5), -3, 5, z(-3)});
  for (int p = 0; p < 25; ++p) flat.shown[static_cast<std::size_t>(p)] = p % 5 < 2 ? 2 : 1;
  return flat;
}

/// Gradients of the parameters of an MLP in float, summed over pixels. on: hidden units that are exactly zero count as
/// active.
std::vector<float> float_gradient(const std::vector<float>& mlp, const std::vector<std::vector<float>>& pixels,
                                  const float* colour_gradient, bool on) {
  std::vector<float> sum(MLP_COUNT, 0.0f);
  for (const std::vector<float>& x : pixels) {
    float h[3][16], d[2][16] = {};
    bool passes[2][16];
    std::copy_n(x.begin(), 16, h[0]);
    for (const int layer : {0, 1})
      for (int o = 0; o < 16; ++o) {
        float s = mlp[(layer ? MLP_B2 : MLP_B1) + o];
        for (int i = 0; i < 16; ++i) s += mlp[(layer ? MLP_W2 : 0) + o * 16 + i] * h[layer][i];
        passes[layer][o] = std::abs(s) < 1e-6f ? on : s > 0;
        h[layer + 1][o] = std::max(s, 0.0f);
      }
    for (int c = 0; c < 3; ++c) {
      float z = mlp[MLP_B3 + c];
      for (int i = 0; i < 16; ++i) z += mlp[MLP_W3 + c * 16 + i] * h[2][i];
      const float y = 1 / (1 + std::exp(-z)), g = colour_gradient[c] * x[3] * y * (1 - y);
      sum[MLP_B3 + c] += g;
      for (int i = 0; i < 16; ++i) {
        sum[MLP_W3 + c * 16 + i] += g * h[2][i];
        if (passes[1][i]) d[1][i] += g * mlp[MLP_W3 + c * 16 + i];
      }
    }
    for (const int layer : {1, 0})
      for (int o = 0; o < 16; ++o) {
        sum[(layer ? MLP_B2 : MLP_B1) + o] += d[layer][o];
        for (int i = 0; i < 16; ++i) {
          sum[(layer ? MLP_W2 : 0) + o * 16 + i] += d[layer][o] * h[layer][i];
          if (layer == 1 && passes[0][i]) d[0][i] += d[1][o] * mlp[MLP_W2 + o * 16 + i];
        }
      }
  }
  return sum;
}

}  // namespace

TEST_CASE("the bound of rounding errors holds in float and is tight", "[ties]") {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> draw(-1, 1);
  for (int n = 0; n < 1000; ++n) {
    float sum = 0;
    double right = 0;
    Rounded bound;
    for (int i = 0; i < 16; ++i) {
      const float a = draw(random), b = draw(random);
      sum += a * b;
      right += double(a) * b;
      bound = bound + Rounded{a, 0} * Rounded{b, 0};
    }
    CHECK(std::abs(bound.value - right) < 1e-12);
    CHECK(std::abs(sum - right) <= bound.bound());
    CHECK(bound.bound() < 3e-6);
    const float quotient = sum / 3.7f;
    CHECK(std::abs(quotient - right / double(3.7f)) <= (bound / Rounded{3.7f, 0}).bound());
  }
  CHECK(std::isinf((Rounded{1, 0} / Rounded{1e-9, 1e-8}).error));
}

TEST_CASE("only pixels where two triangles intersect may show either of them", "[ties]") {
  const VisibilityTies ties = crossed(0).ties();
  for (std::size_t p = 0; p < 25; ++p) {
    CAPTURE(p);
    CHECK(ties.winners[p] == (p % 5 < 2 ? Winners{2} : p % 5 > 2 ? Winners{1} : Winners{1, 2}));
  }
  CHECK(ties.triangles == std::vector<bool>{false, true});  // the shown triangle is certain to be visible
  const VisibilityTies none = crossed(1e-3f).ties();
  for (std::size_t p = 0; p < 25; ++p) CHECK_FALSE(none.tied(p));
  CHECK(none.triangles == std::vector<bool>{false, false});
}

TEST_CASE("a pixel on an edge or at the threshold may show the triangle, the one behind or nothing", "[ties]") {
  Flat flat;
  flat.add({-3, -3, 0.5f, 0.4f, -3, 0.5f, 0.4f, 9, 0.5f});  // covers x < 0.4
  const VisibilityTies edge = flat.ties();
  for (std::size_t p = 0; p < 25; ++p)
    CHECK(edge.winners[p] == (p % 5 < 3 ? Winners{1} : p % 5 > 3 ? Winners{0} : Winners{1, 0}));
  CHECK(edge.triangles[0]);
  Flat half;
  half.add({-3, -3, 0.25f, 5, -3, 0.25f, -3, 5, 0.25f}, 0.5f);
  half.add({-3, -3, 0.5f, 5, -3, 0.5f, -3, 5, 0.5f});
  CHECK(half.ties().winners[12] == Winners{1, 2});
  half.opacity[0] = half.opacity[1] = half.opacity[2] = 0.4999f;
  CHECK(half.ties().winners[12] == Winners{2});
  // A triangle without area can only appear at pixels on its line.
  Flat thin;
  thin.add({-3, -3, 0.5f, 3, 3, 0.5f, 1, 1, 0.5f});
  const VisibilityTies line = thin.ties();
  for (std::size_t p = 0; p < 25; ++p) CHECK(line.may_show(p, 1) == (p % 5 == p / 5));
}

TEST_CASE("another triangle is accepted at a tie and wrong elsewhere", "[ties]") {
  const Flat flat = crossed(0);
  const VisibilityTies ties = flat.ties();
  std::vector<std::uint32_t> drawn = flat.shown;
  drawn[12] = 2;
  const Settlement at_tie = settle(ties, flat.shown, drawn);
  CHECK(at_tie.otherwise == std::vector<std::size_t>{12});
  CHECK(at_tie.wrong == 0);
  // Sums over the image differ until the tie is settled.
  const auto sum_of = [](const std::vector<std::uint32_t>& picture) {
    float sum = 0;
    for (const std::uint32_t t : picture) sum += t == 1 ? 0.2f : 0.9f;
    return std::vector<float>{sum};
  };
  CHECK_FALSE(compare(sum_of(drawn), sum_of(flat.shown), 1e-3).holds);
  for (const std::size_t p : at_tie.otherwise) drawn[p] = flat.shown[p];
  CHECK(compare(sum_of(drawn), sum_of(flat.shown), 1e-3).holds);
  drawn[13] = 2;
  drawn[12] = 0;  // at a tie, but neither of the two
  const Settlement elsewhere = settle(ties, flat.shown, drawn);
  CHECK(elsewhere.otherwise.empty());
  CHECK(elsewhere.wrong == 2);
}

TEST_CASE("sums may differ only by the contribution of a hidden unit at zero", "[ties]") {
  std::mt19937 random(7);
  std::normal_distribution<float> draw(0, 0.5f);
  std::uniform_real_distribution<float> input(0.1f, 1);
  std::vector<float> mlp(MLP_COUNT);
  for (float& p : mlp) p = draw(random);
  std::vector<std::vector<float>> pixels(20, std::vector<float>(16));
  for (auto& x : pixels)
    for (float& v : x) v = input(random);
  constexpr float kColourGradient[3] = {0.3f, -0.2f, 0.5f};
  const int layer = GENERATE(0, 1);
  // Sets the bias such that this unit is zero at the third pixel.
  const int unit = 5;
  float h[16];
  std::copy_n(pixels[2].begin(), 16, h);
  for (int l = 0; l <= layer; ++l) {
    float out[16];
    for (int o = 0; o < 16; ++o) {
      float s = 0;
      for (int i = 0; i < 16; ++i) s += mlp[(l ? MLP_W2 : 0) + o * 16 + i] * h[i];
      if (l == layer && o == unit) mlp[(l ? MLP_B2 : MLP_B1) + o] = -s;
      out[o] = std::max(0.0f, s + mlp[(l ? MLP_B2 : MLP_B1) + o]);
    }
    std::copy_n(out, 16, h);
  }

  std::vector<double> allowance(MLP_COUNT);
  int units = 0;
  for (const auto& x : pixels) {
    std::vector<Rounded> inputs;
    for (const float v : x) inputs.push_back(of_direction(v));
    const HiddenTies ties = hidden_ties(mlp, inputs, kColourGradient);
    units += ties.units;
    for (std::size_t i = 0; i < ties.parameters.size(); ++i) allowance[i] += ties.parameters[i];
  }
  REQUIRE(units == 1);
  std::vector<float> on = float_gradient(mlp, pixels, kColourGradient, true);
  const std::vector<float> off = float_gradient(mlp, pixels, kColourGradient, false);
  CHECK_FALSE(compare(on, off, 1e-4).holds);
  const Compared with = compare(on, off, 1e-4, {}, allowance);
  CHECK(with.holds);
  CHECK(with.relative < 1e-5);
  CHECK(with.allowed < MLP_COUNT - 51);  // does not concern the last layer
  CHECK(compare(off, on, 1e-4, {}, allowance).holds);
  // Errors in a gradient that does not depend on the unit, and errors of twice its contribution are rejected.
  const std::size_t elsewhere = MLP_B3;
  on[elsewhere] *= 1.05f;
  CHECK_FALSE(compare(on, off, 1e-4, {}, allowance).holds);
  on = float_gradient(mlp, pixels, kColourGradient, true);
  const auto most = static_cast<std::size_t>(std::max_element(allowance.begin(), allowance.end()) - allowance.begin());
  on[most] += on[most] - off[most];
  CHECK_FALSE(compare(on, off, 1e-4, {}, allowance).holds);
}

TEST_CASE("excluded values are counted, and NaN is always wrong", "[ties]") {
  const std::vector<float> expected{1, 2, 4}, actual{1, 3, 4};
  CHECK_FALSE(compare(actual, expected, 1e-3).holds);
  const Compared c = compare(actual, expected, 1e-3, {false, true, false});
  CHECK(c.holds);
  CHECK(c.left_out == 1);
  CHECK_FALSE(compare(std::vector<float>{1, std::nanf(""), 4}, expected, 1e-3, {}, std::vector<double>{9, 9, 9}).holds);
}
