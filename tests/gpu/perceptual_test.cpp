// Tests engine/train/quality/flip.h and ms_ssim.h against their definitions in double, without separated filters.
#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>

#include "base/error.h"
#include "gpu/small_scene.h"
#include "train/quality/flip.h"
#include "train/quality/ms_ssim.h"

using namespace trisoup;

namespace {

constexpr double kPi = std::numbers::pi;
using Triple = std::array<double, 3>;

/// A rendering and its photograph.
struct Pair {
  int width = 0, height = 0;
  std::vector<float> colour;
  std::vector<std::uint32_t> target;

  Pair(int w, int h) : width(w), height(h), colour(3 * std::size_t(w * h)), target(std::size_t(w * h)) {}
  std::size_t at(int x, int y) const { return std::size_t(y * width + x); }
  void set(int x, int y, const Triple& shown, const std::array<int, 3>& wanted, bool masked = false) {
    for (std::size_t c = 0; c < 3; ++c) colour[3 * at(x, y) + c] = static_cast<float>(shown[c]);
    target[at(x, y)] = std::uint32_t(wanted[0]) | std::uint32_t(wanted[1]) << 8 | std::uint32_t(wanted[2]) << 16 |
                       (masked ? 0u : 0xff000000u);
  }
  bool masked(int x, int y) const { return target[at(x, y)] >> 31 == 0; }
  /// Display values of rendering (0) and photograph (1); pixels beyond the edge repeat it.
  Triple shown(int picture, int x, int y) const {
    const std::size_t i = at(std::clamp(x, 0, width - 1), std::clamp(y, 0, height - 1));
    if (target[i] >> 31 == 0) return {0, 0, 0};
    Triple result;
    for (std::size_t c = 0; c < 3; ++c)
      result[c] = picture == 0 ? std::clamp<double>(colour[3 * i + c], 0, 1) : (target[i] >> (8 * c) & 255) / 255.0;
    return result;
  }
};

/// The device's measures of a pair.
struct Device {
  gpu::Device* gpu = test::open_device();
  gpu::Buffer colour, target;

  void upload(const Pair& pair) {
    colour = gpu->allocate(4 * pair.colour.size(), "rendering");
    target = gpu->allocate(4 * pair.target.size(), "photograph");
    gpu->upload(colour.address(), pair.colour);
    gpu->upload(target.address(), pair.target);
  }
  std::optional<double> flip(train::Flip& flip, const Pair& pair) {
    upload(pair);
    return flip.measure(colour.address(), target.address(), std::uint32_t(pair.width), std::uint32_t(pair.height));
  }
  double flip(const Pair& pair) {
    train::Flip measure(*gpu);
    return flip(measure, pair).value();
  }
  std::optional<double> ms_ssim(const Pair& pair) {
    upload(pair);
    return train::MsSsim(*gpu).measure(colour.address(), target.address(), std::uint32_t(pair.width),
                                       std::uint32_t(pair.height));
  }
};

/// Noise around a gradient, with edges; the photograph differs by more noise to the right. mask: every so many pixels
/// one is masked out; 0: none.
Pair noisy_pair(int width, int height, int mask) {
  soup::Random random(5);
  Pair pair(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      Triple shown;
      std::array<int, 3> wanted;
      for (std::size_t c = 0; c < 3; ++c) {
        const double base = 0.15 + 0.5 * x / width + (y > height / 2 ? 0.2 : 0.0) - 0.1 * double(c);
        shown[c] = std::clamp(base + 0.2 * (random.uniform01() - 0.5), 0.0, 1.0);
        wanted[c] = int(std::lround(
            255 *
            std::clamp(shown[c] + 0.8 * x / width * (random.uniform01() - 0.5) * (y % 7 == 0 ? 0.0 : 1.0), 0.0, 1.0)));
      }
      pair.set(x, y, shown, wanted, mask > 0 && (x + 3 * y) % mask == 0);
    }
  return pair;
}

// --- FLIP by definition ---

constexpr Triple kRows[]{{10135552.0 / 24577794, 8788810.0 / 24577794, 4435075.0 / 24577794},
                         {2613072.0 / 12288897, 8788810.0 / 12288897, 887015.0 / 12288897},
                         {1425312.0 / 73733382, 8788810.0 / 73733382, 70074185.0 / 73733382}};

double light_of_display(double v) { return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4); }

/// X / Xn, Y / Yn, Z / Zn of light.
Triple relative_to_white(const Triple& light) {
  Triple xyz;
  for (std::size_t i = 0; i < 3; ++i)
    xyz[i] = (kRows[i][0] * light[0] + kRows[i][1] * light[1] + kRows[i][2] * light[2]) /
             (kRows[i][0] + kRows[i][1] + kRows[i][2]);
  return xyz;
}

Triple yycxcz(const Triple& shown) {
  const Triple t =
      relative_to_white({light_of_display(shown[0]), light_of_display(shown[1]), light_of_display(shown[2])});
  return {116 * t[1] - 16, 500 * (t[0] - t[1]), 200 * (t[1] - t[2])};
}

/// Light of YyCxCz, by Cramer's rule.
Triple light_of_yycxcz(const Triple& c) {
  const double y = (c[0] + 16) / 116;
  const Triple relative{y + c[1] / 500, y, y - c[2] / 200};
  Triple xyz;
  for (std::size_t i = 0; i < 3; ++i) xyz[i] = relative[i] * (kRows[i][0] + kRows[i][1] + kRows[i][2]);
  glm::dmat3 m;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) m[column][row] = kRows[row][std::size_t(column)];
  const glm::dvec3 light = glm::inverse(m) * glm::dvec3(xyz[0], xyz[1], xyz[2]);
  return {std::clamp(light.x, 0.0, 1.0), std::clamp(light.y, 0.0, 1.0), std::clamp(light.z, 0.0, 1.0)};
}

Triple lab_with_hunt(const Triple& light) {
  Triple f = relative_to_white(light);
  const double delta = 6.0 / 29;
  for (double& t : f) t = t > delta * delta * delta ? std::cbrt(t) : t / (3 * delta * delta) + 4.0 / 29;
  const double l = 116 * f[1] - 16;
  return {l, 0.01 * l * 500 * (f[0] - f[1]), 0.01 * l * 200 * (f[1] - f[2])};
}

double hyab(const Triple& a, const Triple& b) { return std::abs(a[0] - b[0]) + std::hypot(a[1] - b[1], a[2] - b[2]); }

/// Error of two colours in Lab, redistributed to 0..1.
double redistributed(const Triple& a, const Triple& b) {
  const double most = std::pow(hyab(lab_with_hunt({0, 1, 0}), lab_with_hunt({0, 0, 1})), 0.7);
  const double error = std::pow(hyab(a, b), 0.7);
  return error < 0.4 * most ? 0.95 / (0.4 * most) * error
                            : 0.95 + (error - 0.4 * most) / (most - 0.4 * most) * (1 - 0.95);
}

/// A filter of [2 radius + 1]^2 weights.
struct Filter {
  int radius = 0;
  std::vector<double> weights;
  Filter(int r, const std::function<double(int, int)>& weight) : radius(r) {
    for (int y = -r; y <= r; ++y)
      for (int x = -r; x <= r; ++x) weights.push_back(weight(x, y));
  }
  void divide_by_sum() {
    double sum = 0;
    for (const double w : weights) sum += w;
    for (double& w : weights) w /= sum;
  }
  void balance() {
    double positive = 0, negative = 0;
    for (const double w : weights) (w > 0 ? positive : negative) += w;
    for (double& w : weights) w /= w > 0 ? positive : -negative;
  }
  double at(int x, int y, const std::function<double(int, int)>& value) const {
    double sum = 0;
    for (int j = -radius, i = 0; j <= radius; ++j)
      for (int k = -radius; k <= radius; ++k, ++i) sum += weights[std::size_t(i)] * value(x + k, y + j);
    return sum;
  }
};

struct FlipFilters {
  std::vector<Filter> colour;                        // of Yy, Cx, Cz
  std::vector<Filter> edge_x, edge_y, dot_x, dot_y;  // one each
};

FlipFilters flip_filters(double per_degree) {
  const double parameters[3][4] = {{1, 0.0047, 0, 1e-5}, {1, 0.0053, 0, 1e-5}, {34.1, 0.04, 13.5, 0.025}};
  const int radius = int(std::ceil(3 * std::sqrt(0.04 / (2 * kPi * kPi)) * per_degree));
  FlipFilters filters;
  for (const auto& p : parameters) {
    filters.colour.emplace_back(radius, [&](int x, int y) {
      const double squared = (x * x + y * y) / (per_degree * per_degree);
      return p[0] * std::sqrt(kPi / p[1]) * std::exp(-kPi * kPi * squared / p[1]) +
             p[2] * std::sqrt(kPi / p[3]) * std::exp(-kPi * kPi * squared / p[3]);
    });
    filters.colour.back().divide_by_sum();
  }
  const double deviation = 0.5 * 0.082 * per_degree, s2 = deviation * deviation;
  const auto gauss = [&](int x, int y) { return std::exp(-(x * x + y * y) / (2 * s2)); };
  const int reach = int(std::ceil(3 * deviation));
  filters.edge_x.emplace_back(reach, [&](int x, int y) { return -x * gauss(x, y); });
  filters.edge_y.emplace_back(reach, [&](int x, int y) { return -y * gauss(x, y); });
  filters.dot_x.emplace_back(reach, [&](int x, int y) { return (x * x / s2 - 1) * gauss(x, y); });
  filters.dot_y.emplace_back(reach, [&](int x, int y) { return (y * y / s2 - 1) * gauss(x, y); });
  for (auto* f : {&filters.edge_x, &filters.edge_y, &filters.dot_x, &filters.dot_y}) f->front().balance();
  return filters;
}

/// The error of each pixel; 0 outside the mask.
std::vector<double> flip_by_definition(const Pair& pair, double per_degree) {
  const FlipFilters filters = flip_filters(per_degree);
  std::vector<double> errors;
  for (int y = 0; y < pair.height; ++y)
    for (int x = 0; x < pair.width; ++x) {
      Triple lab[2];
      double edge[2], dot[2];
      for (int picture = 0; picture < 2; ++picture) {
        Triple filtered;
        for (std::size_t c = 0; c < 3; ++c)
          filtered[c] = filters.colour[c].at(x, y, [&](int i, int j) { return yycxcz(pair.shown(picture, i, j))[c]; });
        lab[picture] = lab_with_hunt(light_of_yycxcz(filtered));
        const auto grey = [&](int i, int j) { return (yycxcz(pair.shown(picture, i, j))[0] + 16) / 116; };
        edge[picture] = std::hypot(filters.edge_x[0].at(x, y, grey), filters.edge_y[0].at(x, y, grey));
        dot[picture] = std::hypot(filters.dot_x[0].at(x, y, grey), filters.dot_y[0].at(x, y, grey));
      }
      const double feature =
          std::sqrt(std::max(std::abs(edge[0] - edge[1]), std::abs(dot[0] - dot[1])) / std::sqrt(2.0));
      errors.push_back(pair.masked(x, y) ? 0 : std::pow(redistributed(lab[0], lab[1]), 1 - feature));
    }
  return errors;
}

// --- MS-SSIM by definition ---

struct Plane {
  int width = 0, height = 0;
  std::vector<double> values;
  double operator()(int x, int y) const {
    return values[std::size_t(std::min(y, height - 1) * width + std::min(x, width - 1))];
  }
};

Plane halved_plane(const Plane& p) {
  Plane half{(p.width + 1) / 2, (p.height + 1) / 2, {}};
  for (int y = 0; y < half.height; ++y)
    for (int x = 0; x < half.width; ++x)
      half.values.push_back((p(2 * x, 2 * y) + p(2 * x + 1, 2 * y) + p(2 * x, 2 * y + 1) + p(2 * x + 1, 2 * y + 1)) /
                            4);
  return half;
}

/// Means over the windows: SSIM, and its factor of contrast and structure. Central moments.
std::pair<double, double> mean_ssim(const Plane& a, const Plane& b) {
  double taps[11][11], total = 0;
  for (int j = 0; j < 11; ++j)
    for (int i = 0; i < 11; ++i)
      total += taps[j][i] = std::exp(-((i - 5) * (i - 5) + (j - 5) * (j - 5)) / (2 * 1.5 * 1.5));
  double ssim = 0, structure = 0;
  for (int y = 0; y + 10 < a.height; ++y)
    for (int x = 0; x + 10 < a.width; ++x) {
      double ma = 0, mb = 0, va = 0, vb = 0, cov = 0;
      const auto each = [&](const auto& add) {
        for (int j = 0; j < 11; ++j)
          for (int i = 0; i < 11; ++i) add(taps[j][i] / total, a(x + i, y + j), b(x + i, y + j));
      };
      each([&](double t, double p, double q) { ma += t * p, mb += t * q; });
      each([&](double t, double p, double q) {
        va += t * (p - ma) * (p - ma), vb += t * (q - mb) * (q - mb), cov += t * (p - ma) * (q - mb);
      });
      const double cs = (2 * cov + 0.03 * 0.03) / (va + vb + 0.03 * 0.03);
      structure += cs;
      ssim += cs * (2 * ma * mb + 1e-4) / (ma * ma + mb * mb + 1e-4);
    }
  const double windows = double(a.width - 10) * (a.height - 10);
  return {ssim / windows, structure / windows};
}

double ms_ssim_by_definition(const Pair& pair) {
  const double exponents[]{0.0448, 0.2856, 0.3001, 0.2363, 0.1333};
  double mean = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    Plane planes[2];
    for (int k = 0; k < 2; ++k) {
      planes[k] = {pair.width, pair.height, {}};
      for (int y = 0; y < pair.height; ++y)
        for (int x = 0; x < pair.width; ++x) planes[k].values.push_back(pair.shown(k, x, y)[c]);
    }
    double product = 1;
    for (int scale = 0; scale < 5; ++scale) {
      const auto [ssim, structure] = mean_ssim(planes[0], planes[1]);
      product *= std::pow(std::max(0.0, scale == 4 ? ssim : structure), exponents[scale]);
      for (Plane& p : planes) p = halved_plane(p);
    }
    mean += product / 3;
  }
  return mean;
}

/// The pair with rendering and photograph exchanged. Renderings must have values of 8 bits.
Pair exchanged(const Pair& pair) {
  Pair result(pair.width, pair.height);
  for (int y = 0; y < pair.height; ++y)
    for (int x = 0; x < pair.width; ++x) {
      std::array<int, 3> wanted;
      for (std::size_t c = 0; c < 3; ++c) wanted[c] = int(std::lround(255 * pair.shown(0, x, y)[c]));
      result.set(x, y, pair.shown(1, x, y), wanted);
    }
  return result;
}

/// Rounds the rendering to 8 bits.
Pair rounded(Pair pair) {
  for (float& v : pair.colour) v = std::round(255 * v) / 255;
  return pair;
}

Pair uniform_pair(int side, const Triple& shown, const std::array<int, 3>& wanted) {
  Pair pair(side, side);
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x) pair.set(x, y, shown, wanted);
  return pair;
}

}  // namespace

TEST_CASE("FLIP is as defined at every pixel", "[flip][each_driver]") {
  Device device;
  struct Case {
    int width, height, mask;
    double per_degree;
    std::uint32_t most_pixels;  // of a band
  };
  for (const Case& c : {Case{45, 31, 0, 67, 1 << 20}, Case{45, 31, 11, 67, 7 * 45}, Case{70, 9, 0, 20.5, 1},
                        Case{9, 40, 13, 120, 100}}) {
    CAPTURE(c.width, c.height, c.per_degree);
    const Pair pair = noisy_pair(c.width, c.height, c.mask);
    train::Flip flip(*device.gpu, c.per_degree);
    flip.most_pixels = c.most_pixels;
    const double mean = device.flip(flip, pair).value();
    const std::vector<double> wanted = flip_by_definition(pair, c.per_degree);
    const std::vector<float> shown = flip.error_map();
    REQUIRE(shown.size() == wanted.size());
    double worst = 0, sum = 0, counted = 0;
    for (int y = 0; y < pair.height; ++y)
      for (int x = 0; x < pair.width; ++x) {
        worst = std::max(worst, std::abs(shown[pair.at(x, y)] - wanted[pair.at(x, y)]));
        if (!pair.masked(x, y)) sum += wanted[pair.at(x, y)], ++counted;
      }
    CHECK(worst < 2e-5);
    CHECK(mean == Approx(sum / counted).margin(2e-6));
    CHECK(mean > 0.05);
  }
  test::require_silence(*device.gpu);
}

TEST_CASE("FLIP of known pairs", "[flip]") {
  Device device;
  // Same pictures, bit by bit.
  Pair same = noisy_pair(40, 30, 0);
  for (std::size_t i = 0; i < same.colour.size(); ++i)
    same.colour[i] = float(same.target[i / 3] >> (8 * (i % 3)) & 255) * (1.0f / 255.0f);
  CHECK(device.flip(same) == 0);
  // Uniform pictures have no edges. Black and white differ by 100 in lightness, and green and blue most of all.
  const double most = std::pow(203.30165461, 0.7), knee = 0.4 * most;
  CHECK(device.flip(uniform_pair(20, {0, 0, 0}, {255, 255, 255})) ==
        Approx(0.95 + 0.05 * (std::pow(100, 0.7) - knee) / (most - knee)).margin(1e-6));
  CHECK(device.flip(uniform_pair(20, {0, 1, 0}, {0, 0, 255})) == Approx(1).margin(1e-6));
  CHECK(device.flip(uniform_pair(20, {1, 1, 1}, {255, 255, 255})) == 0);
  // Values beyond 0..1 are shown as 0 and 1.
  CHECK(device.flip(uniform_pair(20, {2, 1.5, 1}, {255, 255, 255})) == 0);
  // Rendering and photograph may be exchanged.
  const Pair pair = rounded(noisy_pair(50, 40, 0));
  CHECK(device.flip(pair) == Approx(device.flip(exchanged(pair))).margin(1e-6));
  // A finer monitor hides noise.
  train::Flip far(*device.gpu, 200);
  CHECK(device.flip(far, pair).value() < 0.8 * device.flip(pair));
  // A picture without pixels to compare.
  Pair none(8, 8);
  train::Flip flip(*device.gpu);
  CHECK_FALSE(device.flip(flip, none));
  for (const double per_degree : {0.5, 401.0, std::nan("")})
    CHECK_THROWS_AS(train::Flip(*device.gpu, per_degree), Error);
}

TEST_CASE("MS-SSIM is as defined", "[ms_ssim][each_driver]") {
  Device device;
  for (const auto& [width, height, mask] : {std::array{161, 161, 0}, std::array{190, 173, 9}}) {
    CAPTURE(width, height, mask);
    const Pair pair = noisy_pair(width, height, mask);
    const double wanted = ms_ssim_by_definition(pair);
    CHECK(device.ms_ssim(pair).value() == Approx(wanted).margin(2e-5));
    CHECK(wanted < 0.95);
  }
  test::require_silence(*device.gpu);
}

TEST_CASE("MS-SSIM of known pairs", "[ms_ssim]") {
  Device device;
  // Too small for five scales.
  CHECK_FALSE(device.ms_ssim(Pair(160, 300)));
  CHECK_FALSE(device.ms_ssim(Pair(300, 160)));
  const Pair pair = rounded(noisy_pair(200, 180, 0));
  const double value = device.ms_ssim(pair).value();
  CHECK(device.ms_ssim(exchanged(pair)).value() == Approx(value).margin(1e-6));
  // Same pictures. In white ones, a rounding error of E[xx + yy] = 2 weighs most, against C2.
  CHECK(device.ms_ssim(uniform_pair(170, {1, 1, 1}, {255, 255, 255})).value() == Approx(1).margin(2 * 0x1p-23 / 9e-4));
  CHECK(device.ms_ssim(uniform_pair(170, {0, 0, 0}, {0, 0, 0})).value() == 1);
  // Pictures of even size and negative structure at all scales: 0.
  Pair negative(176, 176);
  for (int y = 0; y < 176; ++y)
    for (int x = 0; x < 176; ++x) {
      const int wanted = (x / 32 + y / 32) % 2 * 255;
      negative.set(x, y, {1 - wanted / 255.0, 1 - wanted / 255.0, 1 - wanted / 255.0}, {wanted, wanted, wanted});
    }
  CHECK(device.ms_ssim(negative).value() == 0);
  // The example of torchmetrics' documentation: noise of 256 x 256 pixels and 0.75 of it have 0.9627 (1.0: 0.9628).
  soup::Random random(42);
  Pair noise(256, 256);
  for (int y = 0; y < 256; ++y)
    for (int x = 0; x < 256; ++x) {
      Triple shown;
      std::array<int, 3> wanted;
      for (std::size_t c = 0; c < 3; ++c)
        wanted[c] = int(255.999 * random.uniform01()), shown[c] = 0.75 * wanted[c] / 255.0;
      noise.set(x, y, shown, wanted);
    }
  CHECK(device.ms_ssim(noise).value() == Approx(0.96275).margin(2e-4));
}
