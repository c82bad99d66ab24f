// Tests shaders/common: every hand-written gradient against central differences in double.
#include <catch2/catch.hpp>

#include <cmath>
#include <functional>
#include <vector>

#include "common/host.h"
#include "soup/random.h"

using namespace trisoup;

namespace {

double random_in(soup::Random& r, double low, double high) { return low + (high - low) * r.uniform01(); }

/// Central difference of f by x.
double difference(const std::function<double()>& f, double& x, double h = 1e-6) {
  const double x0 = x;
  x = x0 + h;
  const double up = f();
  x = x0 - h;
  const double down = f();
  x = x0;
  return (up - down) / (2 * h);
}

void check_gradient(double actual, double expected, double scale) {
  CHECK(std::abs(actual - expected) <= 1e-5 * std::max(scale, std::abs(expected)));
}

}  // namespace

TEST_CASE("MLP and skip connection: gradients of inputs and all parameters", "[maths]") {
  soup::Random r(1);
  std::vector<double> w(595);
  for (double& v : w) v = random_in(r, -0.6, 0.6);
  double x[16];
  for (double& v : x) v = random_in(r, 0.05, 0.95);
  const glm::dvec3 g(0.3, -0.7, 0.5);  // dL/dcolour
  const auto loss = [&] {
    double h1[16], h2[16], y[3];
    f64::mlp_forward(w.data(), x, h1, h2, y);
    return glm::dot(g, f64::skip_connection(x, {y[0], y[1], y[2]}));
  };
  double h1[16], h2[16], y[3], dy[3], d1[16], d2[16], d3[3], dx[7];
  f64::mlp_forward(w.data(), x, h1, h2, y);
  glm::dvec3 dy_vector, drgb;
  double dmix;
  f64::skip_connection_backward(x, {y[0], y[1], y[2]}, g, dy_vector, drgb, dmix);
  for (int c = 0; c < 3; ++c) dy[c] = dy_vector[c];
  f64::mlp_backward(w.data(), h1, h2, y, dy, d1, d2, d3, dx);
  for (int c = 0; c < 3; ++c) dx[c] += drgb[c];
  dx[3] += dmix;
  for (int i = 0; i < 7; ++i) check_gradient(dx[i], difference(loss, x[i]), 1e-3);
  for (int o = 0; o < 16; ++o) {
    for (int i = 0; i < 16; ++i) {
      check_gradient(d1[o] * x[i], difference(loss, w[o * 16 + i]), 1e-3);
      check_gradient(d2[o] * h1[i], difference(loss, w[272 + o * 16 + i]), 1e-3);
    }
    check_gradient(d1[o], difference(loss, w[256 + o]), 1e-3);
    check_gradient(d2[o], difference(loss, w[528 + o]), 1e-3);
  }
  for (int o = 0; o < 3; ++o) {
    for (int i = 0; i < 16; ++i) check_gradient(d3[o] * h2[i], difference(loss, w[544 + o * 16 + i]), 1e-3);
    check_gradient(d3[o], difference(loss, w[592 + o]), 1e-3);
  }
}

TEST_CASE("SSIM: derivatives of a window and of a whole image", "[maths]") {
  double sum = 0;
  for (int i = 0; i < SSIM_TAPS; ++i) sum += f64::ssim_tap(i);
  CHECK(sum == Approx(1).margin(1e-12));
  CHECK(f64::ssim_tap(3) / f64::ssim_tap(5) == Approx(std::exp(-4 / 4.5)).margin(1e-12));

  soup::Random r(2);
  const int width = 14, height = 13;
  std::vector<double> x(width * height), y(width * height);
  for (double& v : x) v = r.uniform01();
  for (double& v : y) v = r.uniform01();
  const auto window = [&](int ox, int oy) {
    double mx = 0, my = 0, squares = 0, xy = 0;
    for (int j = 0; j < 11; ++j)
      for (int i = 0; i < 11; ++i) {
        const double t = f64::ssim_tap(i) * f64::ssim_tap(j), p = x[(oy + j) * width + ox + i], q = y[(oy + j) * width + ox + i];
        mx += t * p, my += t * q, squares += t * (p * p + q * q), xy += t * p * q;
      }
    return f64::ssim_window(mx, my, squares, xy);
  };
  const int windows = (width - 10) * (height - 10);
  const auto mean = [&] {
    double total = 0;
    for (int oy = 0; oy < height - 10; ++oy)
      for (int ox = 0; ox < width - 10; ++ox) total += window(ox, oy).value;
    return total / windows;
  };
  // As loss_gradient.comp puts it together: the window's derivatives through the transposed window.
  std::vector<double> gradient(x.size(), 0.0);
  for (int oy = 0; oy < height - 10; ++oy)
    for (int ox = 0; ox < width - 10; ++ox) {
      const f64::SsimWindow s = window(ox, oy);
      for (int j = 0; j < 11; ++j)
        for (int i = 0; i < 11; ++i) {
          const int at = (oy + j) * width + ox + i;
          gradient[at] += f64::ssim_tap(i) * f64::ssim_tap(j) * (s.d_x + 2 * x[at] * s.d_xx + y[at] * s.d_xy) / windows;
        }
    }
  for (std::size_t i = 0; i < x.size(); ++i) check_gradient(gradient[i], difference(mean, x[i], 1e-5), 1e-3);
}

TEST_CASE("lattice: indices, weights and hat functions", "[maths]") {
  soup::Random r(3);
  for (std::uint32_t level = 0; level <= 5; ++level) {
    for (std::uint32_t i = 0; i < f64::lattice_samples(level); ++i) {
      std::uint32_t x = 0, y = 0;
      f64::lattice_point(i, x, y);
      REQUIRE(f64::lattice_index(x, y) == i);
      f32::lattice_point(i, x, y);
      REQUIRE(f32::lattice_index(x, y) == i);
    }
    const double side = 1u << level;
    for (int n = 0; n < 300; ++n) {
      double b0 = r.uniform01(), b1 = r.uniform01();
      if (b0 + b1 > 1) b0 = 1 - b0, b1 = 1 - b1;
      const f64::LatticeCell cell = f64::lattice_cell(b0, b1, level);
      CHECK(cell.w0 + cell.w1 + cell.w2 == Approx(1).margin(1e-12));
      for (const auto& [index, weight] : {std::pair(cell.i0, cell.w0), {cell.i1, cell.w1}, {cell.i2, cell.w2}}) {
        std::uint32_t x = 0, y = 0;
        f64::lattice_point(index, x, y);
        const double dx = b0 * side - x, dy = b1 * side - y;
        CHECK(weight == Approx(std::max(0.0, 1 - std::max({std::abs(dx), std::abs(dy), std::abs(dx + dy)}))).margin(1e-9));
      }
    }
  }
  // A constant texture is constant everywhere, to the last bit.
  for (int n = 0; n < 1000; ++n) {
    const f32::LatticeCell cell = f32::lattice_cell(r.uniform01() * 0.5f, r.uniform01() * 0.5f, 5);
    CHECK(f32::lattice_mix(cell, 0.5f, 0.5f, 0.5f) == 0.5f);
  }
}

TEST_CASE("coverage: edge functions about an origin agree with the plane's point", "[maths]") {
  soup::Random r(4);
  int inside = 0;
  for (int n = 0; n < 2000; ++n) {
    glm::dvec4 p[3];
    for (glm::dvec4& v : p) {
      const double w = random_in(r, 0.3, 3);
      v = glm::dvec4(random_in(r, -1, 1) * w, random_in(r, -1, 1) * w, random_in(r, -0.9, 0.9) * w, w);
    }
    const glm::dvec2 origin(random_in(r, -1, 1), random_in(r, -1, 1)), at(random_in(r, -1, 1), random_in(r, -1, 1));
    const f64::PlanePoint point = f64::plane_point(p[0], p[1], p[2], at);
    const f64::TriangleSetup setup = f64::triangle_setup(p[0], p[1], p[2], origin);
    REQUIRE(setup.valid);
    const glm::dvec2 d = at - origin;
    const double e0 = f64::at_offset(setup.e0, d), e1 = f64::at_offset(setup.e1, d), e2 = f64::at_offset(setup.e2, d);
    CHECK((std::min({e0, e1, e2}) >= 0) == point.inside);
    if (!point.inside) continue;
    ++inside;
    CHECK(e0 / (e0 + e1 + e2) == Approx(point.b0).margin(1e-9));
    CHECK(e1 / (e0 + e1 + e2) == Approx(point.b1).margin(1e-9));
    CHECK(f64::at_offset(setup.plane, d) == Approx(point.depth).margin(1e-9));
  }
  CHECK(inside > 100);
}

TEST_CASE("edges: a force is the derivative of the point it acts on", "[maths]") {
  soup::Random r(5);
  for (int n = 0; n < 50; ++n) {
    glm::dvec4 p[3];
    for (glm::dvec4& v : p) v = glm::dvec4(random_in(r, -1, 1), random_in(r, -1, 1), random_in(r, -1, 1), random_in(r, 0.5, 2));
    const double s0 = random_in(r, 0, 0.5), s1 = random_in(r, 0, 0.5), s2 = 1 - s0 - s1;
    const glm::dvec3 force(random_in(r, -1, 1), random_in(r, -1, 1), random_in(r, -1, 1));
    const auto work = [&] {
      const glm::dvec4 c = s0 * p[0] + s1 * p[1] + s2 * p[2];
      return glm::dot(force, glm::dvec3(c) / c.w);
    };
    f64::ClipGradient g{glm::dvec4(0), glm::dvec4(0), glm::dvec4(0)};
    f64::apply_force(p[0], p[1], p[2], s0, s1, s2, force, g);
    const glm::dvec4* gradients[3] = {&g.g0, &g.g1, &g.g2};
    for (int k = 0; k < 3; ++k)
      for (int i = 0; i < 4; ++i) check_gradient((*gradients[k])[i], difference(work, p[k][i]), 1e-2);
  }
}

TEST_CASE("edges: each kind where it belongs", "[maths]") {
  const auto at = [](double x, double y, double z) { return glm::dvec4(x, y, z, 1); };
  const glm::dvec2 p(0, 0), q(0.1, 0), force(1, 0);
  f64::ClipGradient g{glm::dvec4(0), glm::dvec4(0), glm::dvec4(0)};
  const glm::dvec4 big[3] = {at(-3, -3, 0), at(3, -3, 0), at(0, 4, 0)};       // covers both
  const glm::dvec4 far_one[3] = {at(-3, -3, 0.5), at(3, -3, 0.5), at(0, 4, 0.5)};
  const glm::dvec4 left[3] = {at(-3, -3, 0), at(0.05, 0, 0), at(-3, 3, 0)};   // ends between p and q
  const glm::dvec4 only_q[3] = {at(0.05, -1, -0.5), at(3, -1, -0.5), at(0.05, 3, -0.5)};
  const glm::dvec4 tilted[3] = {at(-3, -3, 3), at(3, -3, -3.1), at(0, 4, 0.2)};  // behind big at p, before it at q
  CHECK(f64::edge_force(big[0], big[1], big[2], big[0], big[1], big[2], true, false, 0, 0, p, q, force, true, g) == EDGE_INTERIOR);
  CHECK(f64::edge_force(big[0], big[1], big[2], big[0], big[1], big[2], false, true, 0, 0, p, q, force, true, g) == EDGE_OPACITY);
  CHECK(f64::edge_force(big[0], big[1], big[2], far_one[0], far_one[1], far_one[2], false, false, 0, 0.5, p, q, force, true, g) == EDGE_OPACITY);
  CHECK(f64::edge_force(left[0], left[1], left[2], big[0], big[1], big[2], false, true, 0, 0, p, q, force, true, g) == EDGE_SILHOUETTE);
  // B hides A at q and is not there at p: B's silhouette, none of A's business.
  CHECK(f64::edge_force(big[0], big[1], big[2], only_q[0], only_q[1], only_q[2], false, false, 0, -0.5, p, q, force, true, g) == EDGE_NONE);
  const double tilted_at_q = f64::plane_point(tilted[0], tilted[1], tilted[2], q).depth;
  REQUIRE(tilted_at_q < 0);
  REQUIRE(f64::plane_point(tilted[0], tilted[1], tilted[2], p).depth > 0);
  CHECK(f64::edge_force(big[0], big[1], big[2], tilted[0], tilted[1], tilted[2], false, false, 0, tilted_at_q, p, q, force, true, g) ==
        EDGE_INTERSECTION);
  CHECK(f64::intersection_force({0, 1}, {0, 2}, 1.0) == glm::dvec2(0));
}

TEST_CASE("Adam and VectorAdam are the textbook's", "[maths]") {
  soup::Random r(6);
  double p = 1, m = 0, v = 0, tp = 1, tm = 0, tv = 0, vv = 0, tvv = 0;
  glm::dvec3 q(1), qm(0), tq(1), tqm(0);
  for (int t = 1; t <= 30; ++t) {
    const double g = random_in(r, -1e-6, 1e-6);
    const glm::dvec3 gv(random_in(r, -1, 1), random_in(r, -1, 1), random_in(r, -1, 1));
    const double rate = 0.05 / (1 - std::pow(0.9, t)), second = 1 / std::sqrt(1 - std::pow(0.999, t));
    p -= f64::adam(g, rate, second, m, v);
    q -= f64::vector_adam(gv, rate, second, qm, vv);
    tm = 0.9 * tm + 0.1 * g, tv = 0.999 * tv + 0.001 * g * g;
    tp -= 0.05 * (tm / (1 - std::pow(0.9, t))) / (std::sqrt(tv / (1 - std::pow(0.999, t))) + 1e-8);
    tqm = 0.9 * tqm + 0.1 * gv, tvv = 0.999 * tvv + 0.001 * glm::dot(gv, gv);
    tq -= 0.05 * (tqm / (1 - std::pow(0.9, t))) / (std::sqrt(tvv / (1 - std::pow(0.999, t))) + 1e-8);
  }
  CHECK(p == Approx(tp).epsilon(1e-9));
  CHECK(glm::length(q - tq) < 1e-9);
}

TEST_CASE("spherical harmonics are orthonormal", "[maths]") {
  // Gauss-free quadrature: midpoints in cos(theta) and phi are exact enough for degree 4.
  double gram[9][9] = {};
  const int n = 200;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < 2 * n; ++j) {
      const double z = -1 + 2 * (i + 0.5) / n, phi = 3.14159265358979 * (j + 0.5) / n, s = std::sqrt(1 - z * z);
      double y[9];
      f64::spherical_harmonics({s * std::cos(phi), s * std::sin(phi), z}, y);
      for (int a = 0; a < 9; ++a)
        for (int b = 0; b < 9; ++b) gram[a][b] += y[a] * y[b] * (2.0 / n) * (3.14159265358979 / n);
    }
  for (int a = 0; a < 9; ++a)
    for (int b = 0; b < 9; ++b) CHECK(gram[a][b] == Approx(a == b ? 1 : 0).margin(1e-3));
}

TEST_CASE("thresholds are uniform and do not depend on each other", "[maths]") {
  constexpr int kBins = 64, kDraws = 100000;
  std::vector<int> bins(kBins, 0);
  double together = 0;
  for (std::uint32_t i = 0; i < kDraws; ++i) {
    const std::uint32_t pixel = f64::threshold_pixel(12345, i);
    const double a = f64::threshold_of(pixel, 3), b = f64::threshold_of(pixel, 4);
    REQUIRE(a >= 0);
    REQUIRE(a < 1);
    ++bins[static_cast<int>(a * kBins)];
    together += (a - 0.5) * (b - 0.5);
  }
  double chi = 0;
  for (const int count : bins) chi += std::pow(count - double(kDraws) / kBins, 2) / (double(kDraws) / kBins);
  CHECK(chi < 63 + 5 * std::sqrt(2 * 63.0));
  CHECK(std::abs(together / kDraws) < 5 * (1.0 / 12) / std::sqrt(double(kDraws)));
}
