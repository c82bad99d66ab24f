// Tests shaders/common, compiled as C++: every hand-written gradient against central differences in double, and the
// properties of coverage, lattices, edges and thresholds on which the kernels rely.
#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include <glm/gtc/matrix_transform.hpp>

#include "common/host.h"
#include "npz.h"
#include "scene/camera.h"
#include "shared_data.h"
#include "soup/random.h"

using namespace trisoup;

namespace {

using ClipTriangle = std::array<glm::dvec4, 3>;  // clip coordinates

/// To fill a vector, call this in braces: their order of evaluation is defined, that of parentheses is not.
double random_in(soup::Random& r, double low, double high) { return low + (high - low) * r.uniform01(); }

/// A triangle from NDC positions with random w, on which results in NDC must not depend.
ClipTriangle clip_triangle(soup::Random& r, glm::dvec3 a, glm::dvec3 b, glm::dvec3 c) {
  ClipTriangle t;
  const glm::dvec3 ndc[3] = {a, b, c};
  for (int k = 0; k < 3; ++k) t[k] = random_in(r, 0.4, 2.5) * glm::dvec4(ndc[k], 1);
  return t;
}

/// Fourth-order central difference of f with respect to x. The step is long enough that rounding does not matter.
double difference(const std::function<double()>& f, double& x, double h = 1e-4) {
  const double x0 = x;
  const auto at = [&](double offset) {
    x = x0 + offset;
    return f();
  };
  const double near = at(h) - at(-h), far = at(2 * h) - at(-2 * h);
  x = x0;
  return (8 * near - far) / (12 * h);
}

/// Matches to a relative error of 1e-5, or to the rounding error of the differences if the gradient is near 0.
Approx gradient(double expected) { return Approx(expected).epsilon(1e-5).margin(1e-10); }

f64::ClipGradient no_gradient() { return {glm::dvec4(0), glm::dvec4(0), glm::dvec4(0)}; }

std::array<glm::dvec4, 3> rows(const f64::ClipGradient& g) { return {g.g0, g.g1, g.g2}; }

void check_same(const f64::ClipGradient& actual, const f64::ClipGradient& expected) {
  const auto a = rows(actual), b = rows(expected);
  for (int k = 0; k < 3; ++k)
    for (int i = 0; i < 4; ++i) CHECK(a[k][i] == Approx(b[k][i]).epsilon(1e-9).margin(1e-11));
}

}  // namespace

// --- Neural shading ---

TEST_CASE("MLP: forward pass and gradients with respect to inputs and all 595 parameters", "[maths]") {
  soup::Random r(1);
  int networks = 0, attempts = 0;
  while (networks < 4) {
    REQUIRE(++attempts < 200);
    std::vector<double> w(MLP_COUNT);
    for (double& v : w) v = random_in(r, -0.6, 0.6);
    double x[16];
    for (double& v : x) v = random_in(r, -1, 1);

    double textbook1[16], textbook2[16], nearest_kink = 1;
    int off = 0;
    for (int layer = 0; layer < 2; ++layer)
      for (int o = 0; o < 16; ++o) {
        double sum = w[layer * 272 + 256 + o];
        for (int i = 0; i < 16; ++i) sum += w[layer * 272 + o * 16 + i] * (layer == 0 ? x : textbook1)[i];
        (layer == 0 ? textbook1 : textbook2)[o] = std::max(sum, 0.0);
        nearest_kink = std::min(nearest_kink, std::abs(sum));
        off += sum < 0;
      }
    // Avoids differences across the kink of a ReLU. Inactive units must be among those tested.
    if (nearest_kink < 1e-2 || off < 6 || off > 26) continue;
    ++networks;

    const double g[3] = {0.3, -0.7, 0.5};
    const auto loss = [&] {
      double h1[16], h2[16], y[3];
      f64::mlp_forward(w.data(), x, h1, h2, y);
      return g[0] * y[0] + g[1] * y[1] + g[2] * y[2];
    };
    double h1[16], h2[16], y[3], d1[16], d2[16], d3[3], dx[7];
    f64::mlp_forward(w.data(), x, h1, h2, y);
    for (int i = 0; i < 16; ++i) {
      CHECK(h1[i] == Approx(textbook1[i]).epsilon(1e-12));
      CHECK(h2[i] == Approx(textbook2[i]).epsilon(1e-12));
    }
    for (int o = 0; o < 3; ++o) {
      double sum = w[592 + o];
      for (int i = 0; i < 16; ++i) sum += w[544 + o * 16 + i] * textbook2[i];
      CHECK(y[o] == Approx(1 / (1 + std::exp(-sum))).epsilon(1e-12));
    }

    f64::mlp_backward(w.data(), h1, h2, y, g, d1, d2, d3, dx);
    for (int i = 0; i < 7; ++i) CHECK(dx[i] == gradient(difference(loss, x[i])));
    std::vector<double> dw(MLP_COUNT);
    for (int o = 0; o < 16; ++o) {
      for (int i = 0; i < 16; ++i) {
        dw[o * 16 + i] = d1[o] * x[i];
        dw[MLP_W2 + o * 16 + i] = d2[o] * h1[i];
      }
      dw[MLP_B1 + o] = d1[o];
      dw[MLP_B2 + o] = d2[o];
    }
    for (int o = 0; o < 3; ++o) {
      for (int i = 0; i < 16; ++i) dw[MLP_W3 + o * 16 + i] = d3[o] * h2[i];
      dw[MLP_B3 + o] = d3[o];
    }
    for (int k = 0; k < MLP_COUNT; ++k) {
      INFO("parameter " << k);
      CHECK(dw[k] == gradient(difference(loss, w[k])));
    }
  }
}

TEST_CASE("skip connection: gradients with respect to features and the colour of the MLP", "[maths]") {
  soup::Random r(2);
  for (int n = 0; n < 50; ++n) {
    double f[7];
    for (double& v : f) v = r.uniform01();
    glm::dvec3 y{r.uniform01(), r.uniform01(), r.uniform01()};
    const glm::dvec3 dc{random_in(r, -1, 1), random_in(r, -1, 1), random_in(r, -1, 1)};
    const auto loss = [&] { return glm::dot(dc, f64::skip_connection(f, y)); };
    glm::dvec3 dy, drgb;
    double dmix;
    f64::skip_connection_backward(f, y, dc, dy, drgb, dmix);
    for (int c = 0; c < 3; ++c) {
      CHECK(dy[c] == gradient(difference(loss, y[c])));
      CHECK(drgb[c] == gradient(difference(loss, f[c])));
    }
    CHECK(dmix == gradient(difference(loss, f[3])));
  }
}

TEST_CASE("pixel colour: gradients with respect to features through the MLP and the skip connection", "[maths]") {
  soup::Random r(3);
  std::vector<double> w(MLP_COUNT);
  for (double& v : w) v = random_in(r, -0.5, 0.5);
  double x[16];
  for (double& v : x) v = random_in(r, 0.05, 0.95);
  const glm::dvec3 dc(0.4, -0.9, 0.6);
  const auto loss = [&] {
    double h1[16], h2[16], y[3];
    f64::mlp_forward(w.data(), x, h1, h2, y);
    return glm::dot(dc, f64::skip_connection(x, {y[0], y[1], y[2]}));
  };
  double h1[16], h2[16], y[3], d1[16], d2[16], d3[3], dx[7];
  f64::mlp_forward(w.data(), x, h1, h2, y);
  glm::dvec3 dy, drgb;
  double dmix;
  f64::skip_connection_backward(x, {y[0], y[1], y[2]}, dc, dy, drgb, dmix);
  const double dy_array[3] = {dy[0], dy[1], dy[2]};
  f64::mlp_backward(w.data(), h1, h2, y, dy_array, d1, d2, d3, dx);
  for (int c = 0; c < 3; ++c) dx[c] += drgb[c];
  dx[3] += dmix;
  for (int i = 0; i < 7; ++i) CHECK(dx[i] == gradient(difference(loss, x[i])));
}

TEST_CASE("spherical harmonics are orthonormal and have the published signs", "[maths]") {
  // The quadrature is exact up to rounding: products have degree 4 in z (3-point Gauss-Legendre: up to 5) and order 4
  // in phi (8 midpoints: up to 7).
  const double pi = std::acos(-1.0), node = std::sqrt(0.6);
  double gram[9][9] = {};
  for (const auto& [z, weight] : {std::pair(-node, 5.0 / 9), {0.0, 8.0 / 9}, {node, 5.0 / 9}})
    for (int j = 0; j < 8; ++j) {
      const double phi = 2 * pi * (j + 0.3) / 8, s = std::sqrt(1 - z * z);
      double y[9];
      f64::spherical_harmonics({s * std::cos(phi), s * std::sin(phi), z}, y);
      for (int a = 0; a < 9; ++a)
        for (int b = 0; b < 9; ++b) gram[a][b] += y[a] * y[b] * weight * 2 * pi / 8;
    }
  // The constants have 8 digits.
  for (int a = 0; a < 9; ++a)
    for (int b = 0; b < 9; ++b) CHECK(gram[a][b] == Approx(a == b ? 1 : 0).margin(1e-7));

  const double s = std::sqrt(0.5);
  const glm::dvec3 largest[9] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 0}, {s, s, 0},
                                 {0, s, s}, {0, 0, 1}, {s, 0, s}, {1, 0, 0}};
  const int sign[9] = {1, -1, 1, -1, 1, -1, 1, -1, 1};
  for (int k = 0; k < 9; ++k) {
    double y[9];
    f64::spherical_harmonics(largest[k], y);
    CHECK(sign[k] * y[k] > 0.25);
  }
}

// --- Depth ---

TEST_CASE("depth: the plane's inverse depth, and the loss by the corners", "[maths]") {
  soup::Random r(21);
  int compared = 0;
  for (int i = 0; i < 200; ++i) {
    ClipTriangle t = clip_triangle(r, {-0.9, -0.8, random_in(r, -0.5, 0.5)}, {0.9, -0.7, random_in(r, -0.5, 0.5)},
                                   {0.1, 0.9, random_in(r, -0.5, 0.5)});
    const glm::dvec2 ndc{random_in(r, -0.3, 0.3), random_in(r, -0.3, 0.3)};
    const f64::DepthPlane plane = f64::depth_plane(t[0], t[1], t[2], ndc);
    REQUIRE(plane.valid);
    CHECK(plane.inverse == Approx(1 / f64::plane_point(t[0], t[1], t[2], ndc).w));
    for (int k = 0; k < 3; ++k)
      CHECK(plane.normal.x * t[k].x + plane.normal.y * t[k].y + plane.normal.z * t[k].w == Approx(1));
    // Errors within the square part of the loss and beyond it, of either sign.
    const double measured = plane.inverse * random_in(r, 0.94, 1.06), error = std::abs(plane.inverse / measured - 1);
    if (std::abs(error - 0.02) < 1e-3 || error < 1e-3) continue;
    ++compared;
    const auto loss = [&] { return f64::depth_loss(f64::depth_plane(t[0], t[1], t[2], ndc).inverse, measured); };
    f64::ClipGradient g = no_gradient();
    f64::add_depth_gradient(plane, f64::depth_loss_slope(plane.inverse, measured), g);
    const auto actual = rows(g);
    for (int k = 0; k < 3; ++k)
      for (int c = 0; c < 4; ++c) CHECK(actual[k][c] == gradient(difference(loss, t[k][c], 1e-5)));
  }
  CHECK(compared > 150);
}

TEST_CASE("depth: the loss does not depend on the unit of length", "[maths]") {
  CHECK(f64::depth_loss(2.0, 1.9) == Approx(f64::depth_loss(0.02, 0.019)));
  CHECK(f64::depth_loss(1.0, 1.0) == 0);
}

TEST_CASE("depth: maps are interpolated on a surface and never across an edge", "[maths]") {
  CHECK(f64::between_depths(1.0, 1.04, 1.02, 1.06, 0.25, 0.5) == Approx(1.02));
  CHECK(f64::between_depths(1.0, 1.0, 1.0, 1.2, 0.5, 0.5) == 0);
  CHECK(f64::between_depths(1.0, 0.0, 1.0, 1.0, 0.5, 0.5) == 0);
}

// --- SSIM ---

namespace {

/// One channel and its mean SSIM over complete windows, by definition.
struct SsimImage {
  int width, height;
  std::vector<double> x, y;

  f64::SsimWindow window(int at_x, int at_y) const {
    double mx = 0, my = 0, squares = 0, xy = 0;
    for (int j = 0; j < SSIM_TAPS; ++j)
      for (int i = 0; i < SSIM_TAPS; ++i) {
        const int at = (at_y + j) * width + at_x + i;
        const double tap = f64::ssim_tap(i) * f64::ssim_tap(j);
        mx += tap * x[at];
        my += tap * y[at];
        squares += tap * (x[at] * x[at] + y[at] * y[at]);
        xy += tap * x[at] * y[at];
      }
    return f64::ssim_window(mx, my, squares, xy);
  }

  int windows() const { return (width - 10) * (height - 10); }

  double mean() const {
    double sum = 0;
    for (int j = 0; j < height - 10; ++j)
      for (int i = 0; i < width - 10; ++i) sum += window(i, j).value;
    return sum / windows();
  }

  /// Computed as in ssim.comp and loss_gradient.comp: maps of the derivatives, indexed by the first pixel of the window
  /// and zero if the window leaves the image, are blurred over the windows that contain a pixel.
  std::vector<double> gradient() const {
    std::vector<f64::SsimWindow> maps(x.size(), f64::SsimWindow{0, 0, 0, 0});
    for (int j = 0; j < height - 10; ++j)
      for (int i = 0; i < width - 10; ++i) maps[j * width + i] = window(i, j);
    std::vector<double> out(x.size());
    for (int v = 0; v < height; ++v)
      for (int u = 0; u < width; ++u) {
        double d_x = 0, d_xx = 0, d_xy = 0;
        for (int j = 0; j < SSIM_TAPS; ++j)
          for (int i = 0; i < SSIM_TAPS; ++i) {
            const int map_x = u - 10 + i, map_y = v - 10 + j;
            if (map_x < 0 || map_y < 0) continue;
            const f64::SsimWindow& s = maps[map_y * width + map_x];
            const double tap = f64::ssim_tap(i) * f64::ssim_tap(j);
            d_x += tap * s.d_x;
            d_xx += tap * s.d_xx;
            d_xy += tap * s.d_xy;
          }
        const int at = v * width + u;
        out[at] = (d_x + 2 * x[at] * d_xx + y[at] * d_xy) / windows();
      }
    return out;
  }
};

}  // namespace

TEST_CASE("SSIM: the window is the normalised Gaussian of sigma 1.5", "[maths]") {
  double normaliser = 0, sum = 0, sum_float = 0;
  for (int i = 0; i < SSIM_TAPS; ++i) normaliser += std::exp(-(i - 5) * (i - 5) / 4.5);
  for (int i = 0; i < SSIM_TAPS; ++i) {
    CHECK(f64::ssim_tap(i) == Approx(std::exp(-(i - 5) * (i - 5) / 4.5) / normaliser).epsilon(1e-13));
    sum += f64::ssim_tap(i);
    sum_float += f32::ssim_tap(i);
  }
  CHECK(sum == Approx(1).epsilon(1e-13));
  CHECK(sum_float == Approx(1).epsilon(2e-7));
}

TEST_CASE("SSIM: value and derivatives of a window", "[maths]") {
  soup::Random r(4);
  for (int n = 0; n < 200; ++n) {
    double x = r.uniform01(), squares, xy;
    const double y = r.uniform01(), var_x = random_in(r, 1e-4, 0.2), var_y = random_in(r, 1e-4, 0.2);
    const double covariance = random_in(r, -0.95, 0.95) * std::sqrt(var_x * var_y);
    squares = x * x + var_x + y * y + var_y;
    xy = x * y + covariance;
    const f64::SsimWindow s = f64::ssim_window(x, y, squares, xy);
    CHECK(s.value ==
          Approx((2 * x * y + 1e-4) * (2 * covariance + 9e-4) / ((x * x + y * y + 1e-4) * (var_x + var_y + 9e-4))));
    // The moments are independent variables here. Steps are short because the curve is steep for small variances.
    const auto value = [&] { return f64::ssim_window(x, y, squares, xy).value; };
    CHECK(s.d_x == Approx(difference(value, x, 3e-6)).epsilon(1e-5).margin(1e-8));
    CHECK(s.d_xx == Approx(difference(value, squares, 3e-6)).epsilon(1e-5).margin(1e-8));
    CHECK(s.d_xy == Approx(difference(value, xy, 3e-6)).epsilon(1e-5).margin(1e-8));
  }
  CHECK(f64::ssim_window(0.4, 0.4, 0.5, 0.25).value == Approx(1));
}

TEST_CASE("SSIM: gradient of a whole image from the three maps", "[maths]") {
  soup::Random r(5);
  SsimImage image{14, 13, std::vector<double>(14 * 13), std::vector<double>(14 * 13)};
  for (std::size_t i = 0; i < image.x.size(); ++i) {
    image.y[i] = r.uniform01();
    image.x[i] = 0.6 * image.y[i] + 0.4 * r.uniform01();
  }
  const std::vector<double> ours = image.gradient();
  for (std::size_t i = 0; i < image.x.size(); ++i) {
    INFO("pixel " << i);
    CHECK(ours[i] == gradient(difference([&] { return image.mean(); }, image.x[i])));
  }
}

TEST_CASE("SSIM: golden value and gradient", "[maths]") {
  REQUIRE_SHARED_FOLDER(shared);
  const test::Npz npz = test::load_npz(shared / "golden" / "G_ssim.npz");
  const auto &target = npz.at("target"), &picture = npz.at("image"), &d_image = npz.at("d_image");
  REQUIRE(picture.shape.size() == 4);
  for (int i = 0; i < SSIM_TAPS; ++i) CHECK(f64::ssim_tap(i) == Approx(npz.at("window").f.at(i)).epsilon(1e-6));
  const std::size_t views = picture.shape[0], height = picture.shape[1], width = picture.shape[2];
  const double images = static_cast<double>(views) * 3;
  double ssim = 0, largest = 0, worst = 0;
  for (std::size_t view = 0; view < views; ++view)
    for (std::size_t c = 0; c < 3; ++c) {
      SsimImage image{static_cast<int>(width), static_cast<int>(height), {}, {}};
      const auto at = [&](std::size_t p) { return (view * width * height + p) * 3 + c; };
      for (std::size_t p = 0; p < width * height; ++p) {
        image.x.push_back(picture.f[at(p)]);
        image.y.push_back(target.f[at(p)]);
      }
      ssim += image.mean() / images;
      const std::vector<double> ours = image.gradient();
      for (std::size_t p = 0; p < width * height; ++p) {
        largest = std::max<double>(largest, std::abs(d_image.f[at(p)]));
        worst = std::max(worst, std::abs(ours[p] / images - d_image.f[at(p)]));
      }
    }
  CHECK(ssim == Approx(npz.at("ssim").f.at(0)).epsilon(1e-5));
  CHECK(largest > 1e-5);
  CHECK(worst <= 1e-4 * largest);
}

// --- Lattices ---

namespace {

/// The basis function of sample (x, y) at a level with r cells per side.
double hat(double u, double v, std::uint32_t x, std::uint32_t y) {
  const double dx = u - x, dy = v - y;
  return std::max(0.0, 1 - std::max({std::abs(dx), std::abs(dy), std::abs(dx + dy)}));
}

/// Barycentrics of corners, points on the sides, samples of level 5 and random points.
std::vector<glm::dvec2> barycentrics(soup::Random& r) {
  std::vector<glm::dvec2> out;
  for (int x = 0; x <= 32; ++x)
    for (int y = 0; x + y <= 32; ++y) out.emplace_back(x / 32.0, y / 32.0);
  for (int n = 0; n < 100; ++n) {
    const double s = r.uniform01();
    out.insert(out.end(), {{s, 0}, {0, s}, {s, 1 - s}});
  }
  for (int n = 0; n < 400; ++n) {
    const double b0 = r.uniform01(), b1 = r.uniform01();
    out.push_back(b0 + b1 <= 1 ? glm::dvec2(b0, b1) : glm::dvec2(1 - b0, 1 - b1));
  }
  return out;
}

}  // namespace

TEST_CASE("lattice: conversions of points and indices are inverse", "[maths]") {
  for (std::uint32_t level = 0; level <= 5; ++level) {
    const std::uint32_t r = 1u << level;
    std::uint32_t expected = 0;
    for (std::uint32_t diagonal = 0; diagonal <= r; ++diagonal)
      for (std::uint32_t y = 0; y <= diagonal; ++y, ++expected) {
        CHECK(f64::lattice_index(diagonal - y, y) == expected);
        std::uint32_t px = 99, py = 99;
        f64::lattice_point(expected, px, py);
        CHECK((px == diagonal - y && py == y));
        f32::lattice_point(expected, px, py);
        CHECK((px == diagonal - y && py == y));
      }
    CHECK(f64::lattice_samples(level) == expected);
  }
}

TEST_CASE("lattice: the weights of a cell are hat functions and reproduce linear functions", "[maths]") {
  soup::Random r(6);
  for (std::uint32_t level = 0; level <= 5; ++level) {
    const double side = 1u << level;
    const std::uint32_t samples = f64::lattice_samples(level);
    std::vector<double> texture(samples);
    for (double& v : texture) v = random_in(r, -2, 2);
    for (const glm::dvec2& b : barycentrics(r)) {
      INFO("level " << level << ", barycentrics " << b.x << " " << b.y);
      const f64::LatticeCell cell = f64::lattice_cell(b.x, b.y, level);
      REQUIRE(std::max({cell.i0, cell.i1, cell.i2}) < samples);
      CHECK(cell.w0 + cell.w1 + cell.w2 == Approx(1).epsilon(1e-13));
      CHECK(std::min({cell.w0, cell.w1, cell.w2}) >= -1e-13);
      const auto linear = [&](std::uint32_t index) {
        std::uint32_t x, y;
        f64::lattice_point(index, x, y);
        return 0.3 - 1.7 * x / side + 0.9 * y / side;
      };
      CHECK(f64::lattice_mix(cell, linear(cell.i0), linear(cell.i1), linear(cell.i2)) ==
            Approx(0.3 - 1.7 * b.x + 0.9 * b.y).margin(1e-12));
      double sum = 0;
      for (std::uint32_t i = 0; i < samples; ++i) {
        std::uint32_t x, y;
        f64::lattice_point(i, x, y);
        sum += hat(b.x * side, b.y * side, x, y) * texture[i];
      }
      CHECK(f64::lattice_mix(cell, texture[cell.i0], texture[cell.i1], texture[cell.i2]) == Approx(sum).margin(1e-12));
    }
  }
}

TEST_CASE("lattice: with rounding in float, indices stay in the texture and constants stay constant", "[maths]") {
  soup::Random r(7);
  for (std::uint32_t level = 0; level <= 5; ++level)
    for (int n = 0; n < 3000; ++n) {
      // Along the hypotenuse, where the sum may round to more than 1, and slightly outside the other sides.
      const float b0 = r.uniform01();
      float b1 = n % 2 ? 1 - b0 : r.uniform01() * (1 - b0);
      if (n % 4 == 3) b1 = std::nextafter(b1, 2.0f);
      const f32::LatticeCell cell = f32::lattice_cell(n % 8 == 2 ? -1e-7f : b0, n % 8 == 4 ? -1e-7f : b1, level);
      REQUIRE(std::max({cell.i0, cell.i1, cell.i2}) < f32::lattice_samples(level));
      // A constant opacity of 0.5 must reach a threshold of 0.5 everywhere.
      REQUIRE(f32::lattice_mix(cell, 0.5f, 0.5f, 0.5f) == 0.5f);
      REQUIRE(f32::lattice_mix(cell, 0.3f, 0.3f, 0.3f) == 0.3f);
    }
}

TEST_CASE("lattice: golden lookups", "[maths]") {
  REQUIRE_SHARED_FOLDER(shared);
  const test::Npz npz = test::load_npz(shared / "golden" / "D5_interp.npz");
  const auto& bary = npz.at("bary");
  for (const std::uint32_t level : {0u, 2u, 5u}) {
    const auto& texture = npz.at("feat_l" + std::to_string(level));
    const auto& expected = npz.at("out_l" + std::to_string(level));
    const std::size_t channels = expected.shape.at(1);
    REQUIRE(texture.shape == std::vector<std::size_t>{1, f64::lattice_samples(level), channels});
    for (std::size_t i = 0; i < bary.shape.at(0); ++i) {
      const f64::LatticeCell cell = f64::lattice_cell(bary.f[2 * i], bary.f[2 * i + 1], level);
      for (std::size_t c = 0; c < channels; ++c)
        CHECK(f64::lattice_mix(cell, texture.f[cell.i0 * channels + c], texture.f[cell.i1 * channels + c],
                               texture.f[cell.i2 * channels + c]) == Approx(expected.f[i * channels + c]).margin(3e-5));
    }
  }
}

TEST_CASE("logit is the inverse of sigmoid", "[maths]") {
  double worst = 0, worst_float = 0;
  for (int i = 0; i <= 960; ++i) {
    const double p = 0.02 + i * 0.001, exact = std::log(p / (1 - p));
    worst = std::max(worst, std::abs(f64::logit(p) - exact));
    worst_float = std::max(worst_float, std::abs(double(f32::logit(float(p))) - exact));
  }
  CHECK(worst < 1e-7);
  CHECK(worst_float < 1e-5);
  CHECK(f32::logit(0.5f) == 0);
}

TEST_CASE("a texture without its finest level consists of its even samples", "[maths]") {
  soup::Random random(8);
  for (std::uint32_t level = 0; level <= 5; ++level)
    for (int n = 0; n < 200; ++n) {
      const float b0 = random.uniform01(), b1 = (1 - b0) * random.uniform01();
      const f64::LatticeCell cell = f64::coarser_cell(b0, b1, level),
                             coarse = f64::lattice_cell(b0, b1, level > 0 ? level - 1 : 0);
      CHECK((cell.w0 == coarse.w0 && cell.w1 == coarse.w1 && cell.w2 == coarse.w2));
      std::uint32_t x, y, cx, cy;
      f64::lattice_point(cell.i2, x, y), f64::lattice_point(coarse.i2, cx, cy);
      CHECK((level == 0 ? x == cx && y == cy : x == 2 * cx && y == 2 * cy));
    }
}

// --- Coverage ---

TEST_CASE("coverage: edge functions agree with the point of the plane, for any origin and winding", "[maths]") {
  soup::Random r(8);
  int inside = 0, outside = 0, counter_clockwise = 0, clockwise = 0;
  for (int n = 0; n < 3000; ++n) {
    const auto corner = [&] { return glm::dvec3{random_in(r, -1, 1), random_in(r, -1, 1), random_in(r, -0.9, 0.9)}; };
    const glm::dvec3 a = corner(), b = corner(), c = corner();
    const double area = f64::cross2(glm::dvec2(b - a), glm::dvec2(c - a));
    if (std::abs(area) < 1e-2) continue;
    ++(area > 0 ? counter_clockwise : clockwise);
    const ClipTriangle t = clip_triangle(r, a, b, c);
    const glm::dvec2 at{random_in(r, -1, 1), random_in(r, -1, 1)};

    // The point of the plane projects to `at`, its barycentrics sum to 1, and its depth is linear on the screen.
    const f64::PlanePoint point = f64::plane_point(t[0], t[1], t[2], at);
    const double w0 = f64::cross2(glm::dvec2(b) - at, glm::dvec2(c) - at),
                 w1 = f64::cross2(glm::dvec2(c) - at, glm::dvec2(a) - at);
    const double s0 = w0 / area, s1 = w1 / area, s2 = 1 - s0 - s1;  // linear on the screen
    if (std::min({std::abs(s0), std::abs(s1), std::abs(s2)}) < 1e-6) continue;
    CHECK(point.inside == (s0 > 0 && s1 > 0 && s2 > 0));
    CHECK(point.b0 + point.b1 + point.b2 == Approx(1));
    CHECK(point.depth == Approx(s0 * a.z + s1 * b.z + s2 * c.z).margin(1e-9));
    const glm::dvec4 clip = point.b0 * t[0] + point.b1 * t[1] + point.b2 * t[2];
    // Near the horizon of the plane w approaches 0 and precision is lost.
    if (std::abs(clip.w) > 1e-3 && std::abs(clip.w) < 1e3) {
      CHECK(clip.x / clip.w == Approx(at.x).margin(1e-8));
      CHECK(clip.y / clip.w == Approx(at.y).margin(1e-8));
      CHECK(point.w == Approx(clip.w));
    }
    ++(point.inside ? inside : outside);

    const glm::dvec2 origins[4] = {{0, 0}, at, {-0.93, 0.71}, {random_in(r, -5, 5), random_in(r, -5, 5)}};
    for (const glm::dvec2& origin : origins) {
      const f64::TriangleSetup setup = f64::triangle_setup(t[0], t[1], t[2], origin);
      REQUIRE(setup.valid);
      const glm::dvec2 d = at - origin;
      const double e0 = f64::at_offset(setup.e0, d), e1 = f64::at_offset(setup.e1, d), e2 = f64::at_offset(setup.e2, d);
      CHECK((std::min({e0, e1, e2}) >= 0) == point.inside);
      CHECK(f64::at_offset(setup.plane, d) == Approx(point.depth).margin(1e-9));
      if (std::abs(clip.w) > 1e3) continue;
      CHECK(e0 / (e0 + e1 + e2) == Approx(point.b0).margin(1e-8));
      CHECK(e1 / (e0 + e1 + e2) == Approx(point.b1).margin(1e-8));
    }
  }
  CHECK(inside > 200);
  CHECK(outside > 200);
  CHECK(counter_clockwise > 200);
  CHECK(clockwise > 200);
}

TEST_CASE("coverage: the area at a point is the inverse of the change of barycentrics, also behind the camera",
          "[maths]") {
  soup::Random r(18);
  int compared = 0, crossing = 0;
  for (int n = 0; n < 2000; ++n) {
    glm::dvec4 p[3];
    for (glm::dvec4& corner : p) {
      const double x = random_in(r, -1, 1), y = random_in(r, -1, 1), z = random_in(r, -1, 1),
                   w = random_in(r, -0.5, 1.5);
      corner = {x, y, z, w};
    }
    const double x = random_in(r, -1, 1), y = random_in(r, -1, 1);
    const f64::PlanePoint point = f64::plane_point(p[0], p[1], p[2], {x, y});
    if (!point.inside || point.w < 0.05) continue;
    const auto at = [&](double dx, double dy) {
      const f64::PlanePoint q = f64::plane_point(p[0], p[1], p[2], {x + dx, y + dy});
      return glm::dvec2(q.b0, q.b1);
    };
    constexpr double kStep = 1e-6;
    const glm::dvec2 by_x = (at(kStep, 0) - at(-kStep, 0)) / (2 * kStep),
                     by_y = (at(0, kStep) - at(0, -kStep)) / (2 * kStep);
    CHECK(f64::area_at(p[0], p[1], p[2], {random_in(r, -2, 2), 0.3}, point.b0, point.b1) ==
          Approx(0.5 / std::abs(f64::cross2(by_x, by_y))).epsilon(1e-4));
    ++compared;
    crossing += std::min({p[0].w, p[1].w, p[2].w}) < 0;
  }
  CHECK(compared > 100);
  CHECK(crossing > 20);
  // Seen at a right angle, the area is constant.
  CHECK(f64::area_at({0, 0, 0, 2}, {1, 0, 0, 2}, {0, 1, 0, 2}, {0, 0}, 0.2, 0.3) == Approx(0.125));
}

TEST_CASE("coverage: a degenerate triangle is invalid and covers nothing", "[maths]") {
  const glm::dvec4 a(0.2, 0.3, 0.1, 1), b(-0.4, 0.1, 0.2, 2);
  CHECK(!f64::triangle_setup(a, b, b, {0.1, 0.2}).valid);
  CHECK(!f64::triangle_setup(a, a, a, {0.1, 0.2}).valid);
  CHECK(!f64::plane_point(a, a, b, {0.1, 0.2}).inside);
  CHECK(!f64::plane_point(a, a, a, {0.2, 0.3}).inside);
}

TEST_CASE("coverage: barycentrics of a ray equal those of the projected triangle, in float for small ones", "[maths]") {
  soup::Random r(21);
  int small = 0;
  for (int n = 0; n < 2000; ++n) {
    // A random camera that looks at the origin, in the renderer's form: eye and pixel directions.
    const glm::dvec3 eye{random_in(r, -2, 2), random_in(r, -2, 2), random_in(r, 1, 2)};
    const glm::dmat4 clip_from_world =
        glm::perspective(0.8, 1.3, 0.1, 10.0) * glm::lookAt(eye, glm::dvec3(0), glm::dvec3(0, 1, 0));
    const scene::PixelRays rays = scene::pixel_rays(glm::inverse(clip_from_world));
    CHECK(glm::length(scene::eye(glm::inverse(clip_from_world)) - eye) < 1e-9);
    const double size = n % 2 ? 1.0 : 1e-2;
    const auto corner = [&] {
      return size * glm::dvec3{random_in(r, -1, 1), random_in(r, -1, 1), random_in(r, -1, 1)};
    };
    const glm::dvec3 v0 = corner(), v1 = corner(), v2 = corner();
    const glm::dvec2 at = size * glm::dvec2{random_in(r, -0.5, 0.5), random_in(r, -0.5, 0.5)};
    const auto clip = [&](const glm::dvec3& v) { return clip_from_world * glm::dvec4(v, 1); };
    const f64::PlanePoint point = f64::plane_point(clip(v0), clip(v1), clip(v2), at);
    if (!point.inside) continue;
    const glm::dvec3 direction = rays.centre + at.x * rays.x + at.y * rays.y;
    for (const double factor : {1.0, -3.0}) {
      const f64::Barycentrics b = f64::ray_barycentrics(eye, factor * direction, v2, v0 - v2, v1 - v2);
      CHECK(b.b0 == Approx(point.b0).margin(1e-7));
      CHECK(b.b1 == Approx(point.b1).margin(1e-7));
    }
    // At grazing angles the precision of the position is not sufficient.
    const glm::dvec3 normal = glm::normalize(glm::cross(v0 - v2, v1 - v2));
    if (size == 1.0 || std::abs(glm::dot(normal, glm::normalize(direction))) < 0.2) continue;
    if (glm::length(glm::cross(v0 - v2, v1 - v2)) < 0.2 * size * size) continue;
    ++small;
    const f32::Barycentrics b = f32::ray_barycentrics(glm::vec3(eye), glm::vec3(direction), glm::vec3(v2),
                                                      glm::vec3(v0 - v2), glm::vec3(v1 - v2));
    // 1e-3 is a thirtieth of a cell of level 5.
    CHECK(b.b0 == Approx(point.b0).margin(2e-4));
    CHECK(b.b1 == Approx(point.b1).margin(2e-4));
  }
  CHECK(small > 50);
  const f64::Barycentrics parallel = f64::ray_barycentrics({0, 0, 1}, {1, 0, 0}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  CHECK(parallel.b0 == 0);
  CHECK(parallel.b1 == 0);
}

TEST_CASE("coverage: a nearby origin keeps small triangles exact in float", "[maths]") {
  soup::Random r(9);
  double worst = 0;
  for (int n = 0; n < 500; ++n) {
    const glm::vec2 middle{r.uniform(-1, 1), r.uniform(-1, 1)},
        origin = middle + glm::vec2(r.uniform(-0.01f, 0.01f), 0.004f);
    glm::vec4 p[3];
    for (int k = 0; k < 3; ++k) {
      const float angle = 2.0944f * static_cast<float>(k), w = r.uniform(1, 3);
      p[k] = glm::vec4(w * (middle.x + 2e-3f * std::cos(angle)), w * (middle.y + 2e-3f * std::sin(angle)), 0.1f * w, w);
    }
    const f32::TriangleSetup setup = f32::triangle_setup(p[0], p[1], p[2], origin);
    const glm::vec2 d = middle - origin;
    const f64::PlanePoint exact =
        f64::plane_point(glm::dvec4(p[0]), glm::dvec4(p[1]), glm::dvec4(p[2]), glm::dvec2(origin) + glm::dvec2(d));
    const float e0 = f32::at_offset(setup.e0, d), e1 = f32::at_offset(setup.e1, d), e2 = f32::at_offset(setup.e2, d);
    worst = std::max(worst, std::abs(e0 / (e0 + e1 + e2) - exact.b0));
  }
  CHECK(worst < 2e-3);
}

// --- Edges ---

TEST_CASE("edges: a force is the derivative with respect to the point on which it acts", "[maths]") {
  soup::Random r(10);
  for (int n = 0; n < 50; ++n) {
    ClipTriangle t;
    for (glm::dvec4& v : t) v = {random_in(r, -1, 1), random_in(r, -1, 1), random_in(r, -1, 1), random_in(r, 0.5, 2)};
    const double s0 = random_in(r, 0, 0.5), s1 = random_in(r, 0, 0.5), s2 = 1 - s0 - s1;
    const glm::dvec3 force{random_in(r, -1, 1), random_in(r, -1, 1), random_in(r, -1, 1)};
    const auto work = [&] {
      const glm::dvec4 point = s0 * t[0] + s1 * t[1] + s2 * t[2];
      return glm::dot(force, glm::dvec3(point) / point.w);
    };
    f64::ClipGradient once = no_gradient();
    f64::apply_force(t[0], t[1], t[2], s0, s1, s2, force, once);
    for (int k = 0; k < 3; ++k)
      for (int i = 0; i < 4; ++i) CHECK(rows(once)[k][i] == gradient(difference(work, t[k][i])));
    // The result is added to the gradient.
    f64::ClipGradient twice = once;
    f64::apply_force(t[0], t[1], t[2], s0, s1, s2, force, twice);
    check_same(twice, {2.0 * once.g0, 2.0 * once.g1, 2.0 * once.g2});
  }
}

namespace {

/// Projects a point of camera space (z forward) to clip coordinates, with the near plane at 0.3.
glm::dvec4 in_perspective(const glm::dvec3& v) {
  const double near = 0.3, far = 20;
  return {v.x, v.y, (far + near) / (far - near) * v.z - 2 * far * near / (far - near), v.z};
}

}  // namespace

TEST_CASE("edges: a silhouette is where the segment leaves the triangle, for any corners", "[maths]") {
  soup::Random r(11);
  int kinds[2][2] = {};  // [a corner is behind the camera][the near plane comes first]
  for (int n = 0; n < 60000; ++n) {
    ClipTriangle t;
    for (glm::dvec4& v : t)
      v = in_perspective({random_in(r, -2, 2), random_in(r, -2, 2), random_in(r, n % 2 ? 0.2 : -3, 4)});
    const glm::dvec2 p{random_in(r, -1, 1), random_in(r, -1, 1)},
        q = p + glm::dvec2{random_in(r, -0.7, 0.7), random_in(r, -0.7, 0.7)};
    // From the inverse of the rows (x, y, w): weights that are positive inside and in front of the camera, and z + w,
    // which is positive beyond the near plane.
    glm::dmat3 m;
    for (int k = 0; k < 3; ++k) m[k] = {t[k].x, t[k].y, t[k].w};
    const auto sides = [&](double along) {
      const glm::dvec3 l = glm::inverse(m) * glm::dvec3(p + along * (q - p), 1);
      return glm::dvec4(l, l.x * (t[0].z + t[0].w) + l.y * (t[1].z + t[1].w) + l.z * (t[2].z + t[2].w));
    };
    const auto least = [](const glm::dvec4& v) { return std::min({v.x, v.y, v.z, v.w}); };
    if (least(sides(0)) < 1e-3 || std::abs(glm::determinant(m)) < 1e-2 || least(sides(1)) > -1e-3) continue;
    double in = 0, out = 1;  // bisection for the first exit: the visible part is convex
    for (int i = 0; i < 60; ++i) (least(sides(0.5 * (in + out))) >= 0 ? in : out) = 0.5 * (in + out);
    const glm::dvec4 at = sides(in);
    const int which = static_cast<int>(std::min_element(&at.x, &at.x + 4) - &at.x);
    double second = 1;  // skip almost simultaneous exits
    for (int k = 0; k < 4; ++k)
      if (k != which) second = std::min(second, at[k]);
    if (second < 1e-6) continue;
    const bool behind = std::min({t[0].w, t[1].w, t[2].w}) <= 0;
    const bool crosses = std::min({t[0].z + t[0].w, t[1].z + t[1].w, t[2].z + t[2].w}) < 0;
    glm::dvec3 s(-1);
    REQUIRE(f64::silhouette_point(t[0], t[1], t[2], crosses, p, q, s) == (which < 3));
    ++kinds[behind][which == 3];
    if (which == 3) continue;
    const glm::dvec4 point = s.x * t[0] + s.y * t[1] + s.z * t[2];
    const glm::dvec2 crossing = p + in * (q - p);
    CHECK(s[which] == 0);
    CHECK(std::min({s.x, s.y, s.z}) >= 0);
    CHECK(s.x + s.y + s.z == Approx(1));
    CHECK(point.w > 0.3);
    CHECK(point.x / point.w == Approx(crossing.x).margin(1e-8));
    CHECK(point.y / point.w == Approx(crossing.y).margin(1e-8));
  }
  CHECK(kinds[0][0] > 500);
  CHECK(kinds[1][0] > 500);
  CHECK(kinds[1][1] > 100);
}

TEST_CASE("coverage: of a triangle that reaches behind the camera, only the part in front is inside", "[maths]") {
  soup::Random r(20);
  int seen = 0, behind = 0;
  for (int n = 0; n < 3000; ++n) {
    glm::dvec3 v[3];
    for (glm::dvec3& corner : v) corner = {random_in(r, -2, 2), random_in(r, -2, 2), random_in(r, -3, 3)};
    const glm::dvec4 p[3] = {in_perspective(v[0]), in_perspective(v[1]), in_perspective(v[2])};
    // A point of the triangle and its position on the screen. Behind the camera the position is that of the mirrored
    // point.
    const double a = random_in(r, 0.02, 0.98), b = (1 - a) * random_in(r, 0.02, 0.98), c = 1 - a - b;
    const glm::dvec3 point = a * v[0] + b * v[1] + c * v[2];
    if (std::abs(point.z) < 1e-2 || c < 0.01 || std::abs(glm::determinant(glm::dmat3(v[0], v[1], v[2]))) < 1e-2)
      continue;
    const glm::dvec2 ndc = glm::dvec2(point) / point.z;
    const f64::PlanePoint found = f64::plane_point(p[0], p[1], p[2], ndc);
    CHECK(found.b0 == Approx(a).margin(1e-7));
    CHECK(found.b1 == Approx(b).margin(1e-7));
    CHECK(found.w == Approx(point.z).margin(1e-7));
    CHECK(found.inside == (point.z > 0));
    const glm::dvec2 origin = ndc + glm::dvec2(0.1, -0.2);
    const f64::TriangleSetup setup = f64::triangle_setup(p[0], p[1], p[2], origin);
    const glm::dvec2 d = ndc - origin;
    const double e0 = f64::at_offset(setup.e0, d), e1 = f64::at_offset(setup.e1, d), e2 = f64::at_offset(setup.e2, d);
    CHECK((std::min({e0, e1, e2}) >= 0) == (point.z > 0));
    const double depth = f64::at_offset(setup.plane, d);
    CHECK(depth == Approx(in_perspective(point).z / point.z).epsilon(1e-6));
    if (point.z < 0) CHECK(depth > 1);
    ++(point.z > 0 ? seen : behind);
  }
  CHECK(seen > 500);
  CHECK(behind > 500);
}

TEST_CASE("edges: the gradient of depth gives the normal of the corners", "[maths]") {
  soup::Random r(21);
  for (int n = 0; n < 200; ++n) {
    ClipTriangle t;
    glm::dvec3 ndc[3];
    for (int k = 0; k < 3; ++k) {
      t[k] = in_perspective({random_in(r, -2, 2), random_in(r, -2, 2), random_in(r, 0.2, 4)});
      ndc[k] = glm::dvec3(t[k]) / t[k].w;
    }
    const glm::dvec3 expected = glm::normalize(glm::cross(ndc[1] - ndc[0], ndc[2] - ndc[0]));
    if (std::abs(expected.z) < 1e-3) continue;
    const glm::dvec3 normal =
        glm::normalize(f64::ndc_normal(t[0], t[1], t[2], {random_in(r, -1, 1), random_in(r, -1, 1)}));
    CHECK(std::abs(glm::dot(normal, expected)) == Approx(1).epsilon(1e-9));
  }
}

// In the plane of the pixel axis s and of z, A is the line a . (s, z) = c and B the line b . (s, z) = d, with unit
// vectors a and b. If A moves by m along a, their intersection X moves with a . dX = m and b . dX = 0. Hence ds = m b_z
// / (a_s b_z - a_z b_s). A force f on s does the work f ds, the same as a force f ds/dm a on A.
TEST_CASE("edges: the force of an intersection follows from the motion of the intersection line", "[maths]") {
  soup::Random r(12);
  int tested = 0;
  for (int n = 0; n < 300; ++n) {
    const glm::dvec2 n_a{random_in(r, -2, 2), random_in(r, -2, 2)}, n_b{random_in(r, -2, 2), random_in(r, -2, 2)};
    const glm::dvec2 a = glm::normalize(n_a), b = glm::normalize(n_b);
    if (std::abs(f64::cross2(a, b)) < 0.05) continue;
    ++tested;
    const glm::dvec2 on_b(0.2, -0.4), along_a(-a.y, a.x);
    const double force = random_in(r, -3, 3);
    double moved = 0;
    const auto work = [&] {
      // Intersects A with B, starting from a point of A.
      const glm::dvec2 start = glm::dvec2(-0.3, 0.6) + moved * a;
      return force * (start + along_a * (glm::dot(b, on_b - start) / glm::dot(b, along_a))).x;
    };
    const glm::dvec2 result = f64::intersection_force(n_a, n_b, force);
    CHECK(glm::dot(result, a) == gradient(difference(work, moved)));
    CHECK(glm::dot(result, along_a) == Approx(0).margin(1e-12));  // sliding a plane within itself moves nothing
    // The length and sign of normals do not matter.
    CHECK(glm::length(f64::intersection_force(-3.0 * n_a, n_b, force) - result) <= 1e-12 * glm::length(result));
    CHECK(glm::length(f64::intersection_force(n_a, -0.2 * n_b, force) - result) <= 1e-12 * glm::length(result));
  }
  CHECK(tested > 200);
  CHECK(f64::intersection_force({0, 1}, {0, 2}, 1) == glm::dvec2(0));
  CHECK(f64::intersection_force({0.6, 0.8}, {-0.6, -0.8}, 1) == glm::dvec2(0));
  CHECK(f64::intersection_force({0, 0}, {0, 1}, 1) == glm::dvec2(0));
  CHECK(f64::intersection_force({0, 1}, {0, 0}, 1) == glm::dvec2(0));
}

namespace {

/// A pixel p, one of its four neighbours q, and the force along the axis between them.
struct Pair {
  glm::dvec2 p, q, force;
  bool horizontal;
};

std::vector<Pair> pairs() {
  const glm::dvec2 p(0.13, -0.21);
  return {{p, p + glm::dvec2(0.1, 0), {1.3, 0}, true},
          {p, p - glm::dvec2(0.1, 0), {-0.7, 0}, true},
          {p, p + glm::dvec2(0, 0.1), {0, 0.8}, false},
          {p, p - glm::dvec2(0, 0.1), {0, -1.9}, false}};
}

/// A plane with depth z + slope . (ndc - through).
struct Plane {
  double z;
  glm::dvec2 slope, through;

  double at(glm::dvec2 ndc) const { return z + glm::dot(slope, ndc - through); }
};

/// A triangle in the plane that covers all pixels used here. flip: selects the winding.
ClipTriangle covering(soup::Random& r, const Plane& plane, bool flip) {
  const auto corner = [&](double x, double y) { return glm::dvec3(x, y, plane.at({x, y})); };
  const glm::dvec3 a = corner(-3, random_in(r, -3, -2)), b = corner(3, random_in(r, -3, -2)),
                   c = corner(random_in(r, -1, 1), 4);
  return flip ? clip_triangle(r, b, a, c) : clip_triangle(r, a, b, c);
}

/// A triangle in the plane with an edge through `through`, on the side to which `direction` points.
ClipTriangle ending(soup::Random& r, const Plane& plane, glm::dvec2 through, glm::dvec2 direction, int first) {
  const glm::dvec2 along(-direction.y, direction.x);
  glm::dvec2 corners[3] = {through + 0.5 * along, through - 0.8 * along, through + 2.0 * direction + 0.1 * along};
  std::rotate(corners, corners + first, corners + 3);
  const auto corner = [&](int k) { return glm::dvec3(corners[k], plane.at(corners[k])); };
  return clip_triangle(r, corner(0), corner(1), corner(2));
}

/// Perspective-correct vertex weights at an NDC point, from the inverse of the rows (x, y, w).
glm::dvec3 weights_at(const ClipTriangle& t, glm::dvec2 ndc) {
  glm::dmat3 m;
  for (int k = 0; k < 3; ++k) m[k] = {t[k].x, t[k].y, t[k].w};
  const glm::dvec3 s = glm::inverse(m) * glm::dvec3(ndc, 1);
  return s / (s.x + s.y + s.z);
}

f64::ClipGradient force_at(const ClipTriangle& t, glm::dvec2 ndc, glm::dvec3 force) {
  const glm::dvec3 s = weights_at(t, ndc);
  f64::ClipGradient g = no_gradient();
  f64::apply_force(t[0], t[1], t[2], s.x, s.y, s.z, force, g);
  return g;
}

int edge(const ClipTriangle& a, const ClipTriangle& b, bool same, bool empty, double depth_p, double depth_q,
         const Pair& pair, f64::ClipGradient& g, bool crosses = false) {
  g = no_gradient();
  return f64::edge_force(a[0], a[1], a[2], b[0], b[1], b[2], crosses, same, empty, depth_p, depth_q, pair.p, pair.q,
                         pair.force, pair.horizontal, g);
}

}  // namespace

TEST_CASE("edges: inside a triangle the force acts midway between the pixels", "[maths]") {
  soup::Random r(13);
  for (const Pair& pair : pairs())
    for (const bool flip : {false, true}) {
      const glm::dvec2 middle = 0.5 * (pair.p + pair.q);
      const Plane plane{0.1, {0.2, -0.3}, pair.p};
      const ClipTriangle a = covering(r, plane, flip);
      f64::ClipGradient g;
      CHECK(edge(a, a, true, false, plane.at(pair.p), plane.at(pair.q), pair, g) == EDGE_INTERIOR);
      check_same(g, force_at(a, middle, {pair.force, 0}));
    }
}

TEST_CASE("edges: at an opacity edge the force acts midway between the pixels", "[maths]") {
  soup::Random r(14);
  for (const Pair& pair : pairs())
    for (const bool flip : {false, true}) {
      const glm::dvec2 middle = 0.5 * (pair.p + pair.q);
      const Plane front{0.1, {0.2, -0.3}, pair.p}, back{0.6, {-0.4, 0.1}, pair.p};
      const ClipTriangle a = covering(r, front, flip), b = covering(r, back, !flip);
      f64::ClipGradient g;
      CHECK(edge(a, b, false, false, front.at(pair.p), back.at(pair.q), pair, g) == EDGE_OPACITY);
      check_same(g, force_at(a, middle, {pair.force, 0}));
      CHECK(edge(a, a, false, true, front.at(pair.p), 0, pair, g) == EDGE_OPACITY);  // the background
      check_same(g, force_at(a, middle, {pair.force, 0}));
      // At q, A is nearer than B but transparent; at p, B is nearer than A. Neither triangle has an edge.
      const Plane steep{0.5, -(pair.q - pair.p) / 0.01, pair.p}, between{0.1, {0, 0}, pair.p};
      const ClipTriangle sloping = covering(r, steep, flip), seen = covering(r, between, flip);
      REQUIRE(steep.at(pair.q) < -0.4);
      CHECK(edge(sloping, seen, false, false, 0.5, 0.1, pair, g) == EDGE_NONE);
      check_same(g, no_gradient());
    }
}

TEST_CASE("edges: the force of a silhouette acts where the edge crosses the pixel axis", "[maths]") {
  soup::Random r(15);
  for (const Pair& pair : pairs())
    for (int first = 0; first < 3; ++first) {
      const double t = random_in(r, 0.1, 0.9);
      const glm::dvec2 crossing = pair.p + t * (pair.q - pair.p);
      const Plane plane{0.1, {0.2, -0.3}, pair.p}, back{0.6, {-0.4, 0.1}, pair.p}, front{-0.6, {-0.4, 0.1}, pair.p};
      const ClipTriangle a = ending(r, plane, crossing, glm::normalize(pair.p - pair.q), first);
      const ClipTriangle behind = covering(r, back, first == 1), before = covering(r, front, first == 1);
      REQUIRE(f64::plane_point(a[0], a[1], a[2], pair.p).inside);
      REQUIRE(!f64::plane_point(a[0], a[1], a[2], pair.q).inside);
      f64::ClipGradient g;
      for (const bool empty : {false, true}) {
        CHECK(edge(a, behind, false, empty, plane.at(pair.p), empty ? 0 : back.at(pair.q), pair, g) == EDGE_SILHOUETTE);
        check_same(g, force_at(a, crossing, {pair.force, 0}));
        // The vertex opposite to the edge gets no force.
        CHECK(rows(g)[(5 - first) % 3] == glm::dvec4(0));
      }
      // A triangle in front of A at q has its own edge or hides that of A.
      CHECK(edge(a, before, false, false, plane.at(pair.p), front.at(pair.q), pair, g) == EDGE_NONE);
      check_same(g, no_gradient());
    }
}

TEST_CASE("edges: the cut of a triangle by the near plane is not an edge", "[maths]") {
  soup::Random r(22);
  for (const Pair& pair : pairs()) {
    // The triangle crosses the near plane between the pixels.
    const Plane plane{-0.9, -2.0 * (pair.q - pair.p) / 0.01, pair.p}, back{0.6, {0, 0}, pair.p};
    REQUIRE(plane.at(pair.q) < -1);
    const ClipTriangle a = covering(r, plane, false), b = covering(r, back, false);
    f64::ClipGradient g;
    for (const bool empty : {false, true}) {
      CHECK(edge(a, b, false, empty, plane.at(pair.p), empty ? 0 : 0.6, pair, g, true) == EDGE_NONE);
      check_same(g, no_gradient());
    }
    // An edge beyond the near plane does not change the image; an edge before it does.
    const Plane flat{-0.9, -1.5 * (pair.q - pair.p) / 0.01, pair.p};  // passes -1 at 1/15 of the way
    const glm::dvec2 far_end = pair.p + 0.5 * (pair.q - pair.p), near_end = pair.p + 0.03 * (pair.q - pair.p);
    CHECK(edge(ending(r, flat, far_end, glm::normalize(pair.p - pair.q), 0), b, false, true, -0.9, 0, pair, g, true) ==
          EDGE_NONE);
    CHECK(edge(ending(r, flat, near_end, glm::normalize(pair.p - pair.q), 0), b, false, true, -0.9, 0, pair, g, true) ==
          EDGE_SILHOUETTE);
  }
}

TEST_CASE("edges: intersecting triangles move their intersection line", "[maths]") {
  soup::Random r(16);
  for (int n = 0; n < 60; ++n)
    for (const Pair& pair : pairs()) {
      const int axis = pair.horizontal ? 0 : 1;
      const glm::dvec2 crossing = pair.p + random_in(r, 0.1, 0.9) * (pair.q - pair.p);
      Plane front{0.1, {random_in(r, -1, 1), random_in(r, -1, 1)}, crossing}, other = front;
      // The slope of B puts it in front of A at q.
      other.slope[axis] -= (pair.q - pair.p)[axis] * random_in(r, 2, 10);
      other.slope[1 - axis] = random_in(r, -1, 1);
      ClipTriangle a = covering(r, front, n % 2 == 0);
      const ClipTriangle b = covering(r, other, n % 4 < 2);
      f64::ClipGradient g;
      REQUIRE(edge(a, b, false, false, front.at(pair.p), other.at(pair.q), pair, g) == EDGE_INTERSECTION);
      // Total force: the derivative with respect to a common motion of all NDC positions.
      glm::dvec3 total(0);
      for (int k = 0; k < 3; ++k) total += glm::dvec3(rows(g)[k]) * a[k].w;
      glm::dvec3 moved(0);
      const auto work = [&] {
        ClipTriangle shifted = a;
        for (glm::dvec4& v : shifted) v += glm::dvec4(moved * v.w, 0);
        // Depth is linear on the screen, so one secant step gives the crossing.
        const auto gap = [&](glm::dvec2 at) {
          return f64::plane_point(shifted[0], shifted[1], shifted[2], at).depth -
                 f64::plane_point(b[0], b[1], b[2], at).depth;
        };
        const double at_p = gap(pair.p), at_q = gap(pair.q);
        return pair.force[axis] * (pair.p + (pair.q - pair.p) * (at_p / (at_p - at_q)))[axis];
      };
      CHECK(total[axis] == Approx(difference(work, moved[axis])).epsilon(1e-5).margin(1e-8));
      CHECK(total.z == Approx(difference(work, moved.z)).epsilon(1e-5).margin(1e-8));
      CHECK(total[1 - axis] == Approx(0).margin(1e-11));
      // The force acts on A midway between the pixels.
      check_same(g, force_at(a, 0.5 * (pair.p + pair.q), total));
    }
}

TEST_CASE("edges: a triangle that only hides another one has its own edge", "[maths]") {
  soup::Random r(17);
  for (const Pair& pair : pairs())
    for (int first = 0; first < 3; ++first) {
      const glm::dvec2 crossing = 0.4 * pair.p + 0.6 * pair.q;
      const Plane plane{0.1, {0.2, -0.3}, pair.p}, front{-0.4, {0.1, 0.1}, pair.p};
      const ClipTriangle a = covering(r, plane, first == 1);
      // B begins between the pixels.
      const ClipTriangle b = ending(r, front, crossing, glm::normalize(pair.q - pair.p), first);
      REQUIRE(f64::plane_point(b[0], b[1], b[2], pair.q).inside);
      REQUIRE(!f64::plane_point(b[0], b[1], b[2], pair.p).inside);
      f64::ClipGradient g;
      CHECK(edge(a, b, false, false, plane.at(pair.p), front.at(pair.q), pair, g) == EDGE_NONE);
      check_same(g, no_gradient());
      // B is in front of A at both pixels and transparent at p: an opacity edge of B.
      const ClipTriangle over = covering(r, front, first == 2);
      CHECK(edge(a, over, false, false, plane.at(pair.p), front.at(pair.q), pair, g) == EDGE_NONE);
      check_same(g, no_gradient());
      // The plane of B is behind A at p, but B does not reach p.
      Plane through = plane;
      through.through = crossing;
      through.z = plane.at(crossing);
      through.slope -= 5.0 * (pair.q - pair.p);
      const ClipTriangle short_of_p = ending(r, through, crossing, glm::normalize(pair.q - pair.p), first);
      REQUIRE(through.at(pair.p) > plane.at(pair.p));
      REQUIRE(through.at(pair.q) < plane.at(pair.q));
      CHECK(edge(a, short_of_p, false, false, plane.at(pair.p), through.at(pair.q), pair, g) == EDGE_NONE);
      check_same(g, no_gradient());
    }
}

// --- Optimisers ---

TEST_CASE("Adam and VectorAdam equal their definitions", "[maths]") {
  soup::Random r(18);
  // Gradients far above, near and far below epsilon, which only matters for the last.
  for (const double size : {1.0, 1e-4, 1e-8}) {
    const double learning_rate = 0.05;
    double p = 1, m = 0, v = 0, tp = 1, tm = 0, tv = 0, vector_v = 0, tvv = 0;
    glm::dvec3 q(1), qm(0), tq(1), tqm(0);
    for (int t = 1; t <= 20; ++t) {
      // A parameter without gradients so far must not change.
      const double scale = t <= 2 ? 0 : size;
      const double g = scale * random_in(r, -1, 1);
      const glm::dvec3 gv = scale * glm::dvec3{random_in(r, -1, 1), random_in(r, -1, 1), random_in(r, -1, 1)};
      const double correct1 = 1 - std::pow(0.9, t), correct2 = 1 - std::pow(0.999, t);
      const double rate = learning_rate / correct1, second = 1 / std::sqrt(correct2);
      p -= f64::adam(g, rate, second, m, v);
      q -= f64::vector_adam(gv, rate, second, qm, vector_v);
      tm = 0.9 * tm + (1 - 0.9) * g;
      tv = 0.999 * tv + (1 - 0.999) * g * g;
      tp -= learning_rate * (tm / correct1) / (std::sqrt(tv / correct2) + 1e-8);
      tqm = 0.9 * tqm + (1 - 0.9) * gv;
      tvv = 0.999 * tvv + (1 - 0.999) * (gv.x * gv.x + gv.y * gv.y + gv.z * gv.z);
      tq -= learning_rate * (tqm / correct1) / (std::sqrt(tvv / correct2) + 1e-8);
      CHECK(p == Approx(tp).epsilon(1e-12).margin(1e-13));
      CHECK(m == Approx(tm).epsilon(1e-12));
      CHECK(v == Approx(tv).epsilon(1e-12));
      CHECK(vector_v == Approx(tvv).epsilon(1e-12));
      CHECK(glm::length(q - tq) < 1e-13);
      CHECK(glm::length(qm - tqm) <= 1e-12 * glm::length(tqm));
      if (t <= 2) CHECK(p == 1);
    }
    CHECK(p != 1);
  }
}

TEST_CASE("VectorAdam is rotation-equivariant", "[maths]") {
  soup::Random r(19);
  const glm::dmat3 turn = r.rotation();
  glm::dvec3 m(0), turned_m(0);
  double v = 0, turned_v = 0;
  for (int t = 1; t <= 5; ++t) {
    const glm::dvec3 g{random_in(r, -1, 1), random_in(r, -1, 1), random_in(r, -1, 1)};
    const glm::dvec3 step = f64::vector_adam(g, 0.1, 2.0, m, v),
                     turned_step = f64::vector_adam(turn * g, 0.1, 2.0, turned_m, turned_v);
    CHECK(glm::length(turn * step - turned_step) < 1e-12);
  }
}

// --- Random numbers ---

namespace {

/// Chi-squared statistic: the sum of (observed - expected)^2 / expected, with equal expectations.
double chi_square(const std::vector<int>& bins, int draws) {
  const double expected = static_cast<double>(draws) / static_cast<double>(bins.size());
  double sum = 0;
  for (const int count : bins) sum += (count - expected) * (count - expected) / expected;
  return sum;
}

/// Limit of the statistic: five standard deviations above its mean. Counters are fixed, so results never vary.
double chi_square_limit(std::size_t bins) {
  const double freedom = static_cast<double>(bins) - 1;
  return freedom + 5 * std::sqrt(2 * freedom);
}

}  // namespace

TEST_CASE("hash32 is invertible, so different counters have different hashes", "[maths]") {
  // Multiplication by an odd number is inverted by its modular inverse, x ^= x >> n by x ^= x >> n ^ x >> 2n ^ ...
  CHECK(0x7feb352du * 0x1d69e2a5u == 1u);
  CHECK(0x846ca68bu * 0x43021123u == 1u);
  const auto undo = [](std::uint32_t x) {
    x ^= x >> 16;
    x *= 0x43021123u;
    x ^= x >> 15 ^ x >> 30;
    x *= 0x1d69e2a5u;
    x ^= x >> 16;
    return x;
  };
  soup::Random r(20);
  std::vector<std::uint32_t> hashes;
  for (std::uint32_t i = 0; i < 100000; ++i) {
    REQUIRE(undo(f64::hash32(i)) == i);
    REQUIRE(undo(f64::hash32(~i)) == ~i);
    const std::uint32_t word = r.bits();
    REQUIRE(undo(f64::hash32(word)) == word);
    hashes.push_back(f32::hash32(i));
  }
  std::sort(hashes.begin(), hashes.end());
  CHECK(std::adjacent_find(hashes.begin(), hashes.end()) == hashes.end());
}

TEST_CASE("thresholds are uniform over pixels, triangles and steps", "[maths]") {
  constexpr int kBins = 64, kDraws = 100000;
  const auto check_uniform = [&](const auto& draw) {
    std::vector<int> bins(kBins, 0);
    for (std::uint32_t i = 0; i < kDraws; ++i) {
      const double value = draw(i);
      REQUIRE(value > 0);
      REQUIRE(value <= 1);
      ++bins[static_cast<int>((1 - value) * kBins)];
    }
    CHECK(chi_square(bins, kDraws) < chi_square_limit(kBins));
  };
  for (const std::uint32_t key : {0u, 12345u, 0xdeadbeefu}) {
    check_uniform([&](std::uint32_t i) { return f64::threshold_of(f64::threshold_pixel(key, i), 7); });
    check_uniform([&](std::uint32_t i) { return f64::threshold_of(f64::threshold_pixel(key, 4711), i); });
    check_uniform(
        [&](std::uint32_t i) { return f64::threshold_of(f64::threshold_pixel(f64::hash32(key + i), 4711), 7); });
  }
  // 24 bits: float and double give the same numbers.
  for (std::uint32_t i = 0; i < 1000; ++i) CHECK(f64::threshold_of(i, i * i) == f32::threshold_of(i, i * i));
}

TEST_CASE("no threshold is 0 and none is above 1", "[maths]") {
  // Counters with the smallest and the largest possible hash.
  int smallest = 0, largest = 0;
  for (std::uint32_t i = 0; i < 1u << 26; ++i) {
    const std::uint32_t bits = f32::hash32(i) >> 8;
    if (bits != 0 && bits != 0xffffff) continue;
    ++(bits == 0 ? smallest : largest);
    CHECK(f32::threshold_of(i, 0) == (bits == 0 ? 0x1p-24f : 1.0f));
  }
  CHECK(smallest > 0);
  CHECK(largest > 0);
}

TEST_CASE("thresholds of different triangles, pixels and steps are independent", "[maths]") {
  constexpr int kSide = 16, kDraws = 100000;
  const auto check_independent = [&](const auto& draw_a, const auto& draw_b) {
    std::vector<int> bins(kSide * kSide, 0);
    for (std::uint32_t i = 0; i < kDraws; ++i)
      ++bins[static_cast<int>(draw_a(i) * kSide) * kSide + static_cast<int>(draw_b(i) * kSide)];
    CHECK(chi_square(bins, kDraws) < chi_square_limit(bins.size()));
  };
  const auto draw = [](std::uint32_t key, std::uint32_t pixel, std::uint32_t triangle) {
    return 1 - f64::threshold_of(f64::threshold_pixel(key, pixel), triangle);
  };
  const std::uint32_t key = f64::hash32(99);
  for (const std::uint32_t other : {1u, 2u, 64u, 1000u}) {
    INFO("distance " << other);
    check_independent([&](std::uint32_t i) { return draw(key, i, 3); },
                      [&](std::uint32_t i) { return draw(key, i, 3 + other); });
    check_independent([&](std::uint32_t i) { return draw(key, i, 3); },
                      [&](std::uint32_t i) { return draw(key, i + other, 3); });
    check_independent([&](std::uint32_t i) { return draw(key, i, 3); },
                      [&](std::uint32_t i) { return draw(f64::hash32(99 + other), i, 3); });
    check_independent([&](std::uint32_t i) { return draw(key, 5, i); },
                      [&](std::uint32_t i) { return draw(key, 5 + other, i); });
  }
}
