// Tests shaders/common/exposure.h, compiled as C++: the gradient against finite differences in double, the fit, and
// centring over all photographs.
#include <catch2/catch.hpp>

#include <array>
#include <cmath>
#include <vector>

#include "common/host.h"
#include "soup/random.h"

using namespace trisoup;

namespace {

glm::dvec3 random_vector_in(soup::Random& r, double low, double high) {
  return {r.uniform(low, high), r.uniform(low, high), r.uniform(low, high)};
}

/// A pixel of a rendering and of its photograph.
struct Pixel {
  glm::dvec3 colour, photograph;
};

/// As many updates as in a training.
f64::Exposure fit(const std::vector<Pixel>& pixels, int times) {
  f64::Exposure m{glm::dvec3(1), glm::dvec3(0), 0};
  for (int i = 0; i < times; ++i) {
    glm::dvec4 sums[EXPOSURE_SUMS]{};
    for (const Pixel& p : pixels) f64::add_to_exposure(p.colour, p.photograph, m, sums);
    m = f64::fitted_exposure(sums);
  }
  return m;
}

constexpr int kPhotographs = 7;
const f64::Exposure kTinted{{0.8, 1.1, 1.25}, {0.02, -0.01, 0.03}, 0};

std::vector<Pixel> tinted_pixels(double noise) {
  soup::Random r(5);
  std::vector<Pixel> pixels;
  for (int i = 0; i < 4000; ++i) {
    const glm::dvec3 c = random_vector_in(r, 0.05, 0.75);
    pixels.push_back({c, f64::exposed(kTinted, c) + random_vector_in(r, -noise, noise)});
  }
  return pixels;
}

}  // namespace

TEST_CASE("exposure: gradient with respect to the colour, also where the photograph is saturated", "[exposure]") {
  soup::Random r(1);
  int ended = 0;
  for (int i = 0; i < 200; ++i) {
    const f64::Exposure m{random_vector_in(r, 0.5, 1.8), random_vector_in(r, -0.4, 0.4), 0};
    glm::dvec3 c = random_vector_in(r, 0, 1), photograph = random_vector_in(r, 0.1, 0.9);
    const glm::dvec3 d = random_vector_in(r, -1, 1), shown = f64::exposed(m, c);
    for (int k = 0; k < 3; ++k) {
      if (r.uniform01() < 0.3) photograph[k] = r.uniform01() < 0.5 ? 0.0 : 1.0;
      ended += (photograph[k] == 1 && shown[k] > 1) || (photograph[k] == 0 && shown[k] < 0);
      if (std::abs(shown[k]) < 1e-3 || std::abs(shown[k] - 1) < 1e-3)
        photograph[k] = 0.5;  // no finite difference across a kink
    }
    const glm::dvec3 gradient = f64::recorded_backward(m, c, photograph, d);
    for (int k = 0; k < 3; ++k) {
      const auto loss = [&](double step) {
        glm::dvec3 at = c;
        at[k] += step;
        return glm::dot(d, f64::recorded(f64::exposed(m, at), photograph));
      };
      CHECK(gradient[k] == Approx((loss(1e-4) - loss(-1e-4)) / 2e-4).epsilon(1e-6).margin(1e-9));
    }
  }
  CHECK(ended > 15);
}

TEST_CASE("exposure: a known exposure is recovered, also if a fifth of the rendering is wrong", "[exposure]") {
  const f64::Exposure exact = fit(tinted_pixels(0), 30);
  auto wrong = tinted_pixels(0.02);
  for (std::size_t i = 0; i < wrong.size(); i += 5)
    wrong[i].colour = glm::dvec3(0.9, 0.1, 0.1);  // as if an object were in front
  const f64::Exposure robust = fit(wrong, 30);
  for (int k = 0; k < 3; ++k) {
    CHECK(exact.gain[k] == Approx(kTinted.gain[k]).margin(1e-3));
    CHECK(exact.offset[k] == Approx(kTinted.offset[k]).margin(1e-3));
    const double grey = 0.4;
    CHECK(robust.gain[k] * grey + robust.offset[k] == Approx(kTinted.gain[k] * grey + kTinted.offset[k]).margin(0.02));
  }
}

TEST_CASE("exposure: without sufficient data the fit is the identity or near it", "[exposure]") {
  const f64::Exposure none = fit({}, 3);
  CHECK(none.gain == glm::dvec3(1));
  CHECK(none.offset == glm::dvec3(0));
  // Saturated photographs give only a bound.
  CHECK(fit({{glm::dvec3(0.7), glm::dvec3(0.5, 0.5, 1)}, {glm::dvec3(0.7), glm::dvec3(0, 0.5, 0.5)}}, 3).gain ==
        glm::dvec3(1));
  // A single colour does not separate gain and offset.
  const f64::Exposure plain = fit(std::vector<Pixel>(100, {glm::dvec3(0.5), glm::dvec3(0.6)}), 30);
  for (int k = 0; k < 3; ++k) {
    CHECK(plain.gain[k] * 0.5 + plain.offset[k] == Approx(0.6).margin(1e-3));
    CHECK(plain.gain[k] > 1.15);
    CHECK(std::abs(plain.offset[k]) < 0.02);
  }
  // A rendering that explains little of the photograph has little effect.
  soup::Random r(3);
  std::vector<Pixel> noise;
  for (int i = 0; i < 4000; ++i) noise.push_back({random_vector_in(r, 0, 1), random_vector_in(r, 0.1, 0.9)});
  const f64::Exposure little = fit(noise, 10);
  for (int k = 0; k < 3; ++k) CHECK(std::abs(little.gain[k] - 1) < 0.35);
}

TEST_CASE("exposure: float and double agree", "[exposure]") {
  const auto pixels = tinted_pixels(0.02);
  glm::dvec4 sums[EXPOSURE_SUMS]{};
  glm::vec4 sums_float[EXPOSURE_SUMS]{};
  for (const Pixel& p : pixels) f64::add_to_exposure(p.colour, p.photograph, kTinted, sums);
  for (int i = 0; i < EXPOSURE_SUMS; ++i) sums_float[i] = glm::vec4(sums[i]);
  const f64::Exposure m = f64::fitted_exposure(sums);
  const f32::Exposure n = f32::fitted_exposure(sums_float);
  for (int k = 0; k < 3; ++k) {
    CHECK(n.gain[k] == Approx(m.gain[k]).margin(1e-4));
    CHECK(n.offset[k] == Approx(m.offset[k]).margin(1e-4));
  }
}

TEST_CASE("exposure: after centring the mean is the identity, and share 1 keeps all differences", "[exposure]") {
  soup::Random r(2);
  std::array<f64::Exposure, kPhotographs> all;
  f64::Exposure mean{glm::dvec3(0), glm::dvec3(0), 0};
  for (f64::Exposure& m : all) {
    m = {random_vector_in(r, 0.6, 1.9), random_vector_in(r, -0.1, 0.1), 0};
    mean.gain += m.gain / double(kPhotographs);
    mean.offset += m.offset / double(kPhotographs);
  }
  f64::Exposure rest_mean{glm::dvec3(0), glm::dvec3(0), 0};
  const double share = GENERATE(0.0, 0.4, 1.0);
  for (const f64::Exposure& m : all) {
    const f64::Exposure rest = f64::exposure_beyond(m, mean, share);
    rest_mean.gain += rest.gain / double(kPhotographs);
    rest_mean.offset += rest.offset / double(kPhotographs);
    const glm::dvec3 c = random_vector_in(r, 0, 1), again = f64::exposed(rest, f64::exposed(mean, c)),
                     once = f64::exposed(m, c);
    for (int k = 0; k < 3; ++k) {
      if (share == 1) CHECK(again[k] == Approx(once[k]).margin(1e-12));
      if (share == 0) CHECK((rest.gain[k] == 1 && rest.offset[k] == 0));
    }
  }
  for (int k = 0; k < 3; ++k) {
    CHECK(rest_mean.gain[k] == Approx(1).margin(1e-12));
    CHECK(rest_mean.offset[k] == Approx(0).margin(1e-12));
  }
}

TEST_CASE("exposure: differences are shrunk according to the errors of the fits", "[exposure]") {
  CHECK(f64::exposure_share(0.01, 0.02) == 0);
  CHECK(f64::exposure_share(0.02, 0.02) == 0);
  CHECK(f64::exposure_share(0, 0) == 0);
  CHECK(f64::exposure_share(0.04, 0.01) == Approx(0.75));
  // The variance of a fit is that of ten pixels with its error.
  const double error = 0.03;
  soup::Random r(4);
  std::vector<Pixel> pixels;
  for (int i = 0; i < 4000; ++i) {
    const glm::dvec3 c = random_vector_in(r, 0.3, 0.5);
    pixels.push_back({c, c + (i % 2 ? error : -error)});
  }
  CHECK(fit(pixels, 2).variance == Approx(error * error / 10 / (0.16 + 0.01 / 3)).epsilon(0.02));
}
