// Tests shaders/common/exposure.h, compiled as C++: the gradient against finite differences in double, the group of
// exposures, and the fit.
#include <catch2/catch.hpp>

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
f64::Exposure fit(const std::vector<Pixel>& pixels, int times, const glm::dvec3& start = glm::dvec3(0)) {
  f64::Exposure m{start, 0};
  for (int i = 0; i < times; ++i) {
    glm::dvec4 sums[EXPOSURE_SUMS]{};
    for (const Pixel& p : pixels) f64::add_to_exposure(p.colour, p.photograph, m, sums);
    m = f64::fitted_exposure(sums, m, start, 1);
  }
  return m;
}

const f64::Exposure kTinted{{-0.4, 0.2, 0.7}, 0};

std::vector<Pixel> tinted_pixels(double noise) {
  soup::Random r(5);
  std::vector<Pixel> pixels;
  for (int i = 0; i < 4000; ++i) {
    const glm::dvec3 c = random_vector_in(r, 0.1, 0.8);
    pixels.push_back({c, f64::exposed(kTinted, c) + random_vector_in(r, -noise, noise)});
  }
  return pixels;
}

}  // namespace

TEST_CASE("exposure: multiplies odds, keeps black and white, and its gradient is right", "[exposure]") {
  soup::Random r(1);
  for (int i = 0; i < 200; ++i) {
    const f64::Exposure m{random_vector_in(r, -1, 1), 0};
    const glm::dvec3 c = random_vector_in(r, 0.02, 0.98), d = random_vector_in(r, -1, 1), shown = f64::exposed(m, c);
    const glm::dvec3 gradient = f64::exposed_backward(m, c, d);
    for (int k = 0; k < 3; ++k) {
      CHECK(std::log(shown[k] / (1 - shown[k])) == Approx(std::log(c[k] / (1 - c[k])) + m.gain[k]).margin(1e-12));
      const auto loss = [&](double step) {
        glm::dvec3 at = c;
        at[k] += step;
        return glm::dot(d, f64::exposed(m, at));
      };
      CHECK(gradient[k] == Approx((loss(1e-5) - loss(-1e-5)) / 2e-5).epsilon(1e-6).margin(1e-9));
      CHECK(f64::unexposed(m, shown)[k] == Approx(c[k]).margin(1e-12));
    }
  }
  CHECK(f64::exposed(kTinted, glm::dvec3(0)) == glm::dvec3(0));
  CHECK(f64::exposed(kTinted, glm::dvec3(1)) == glm::dvec3(1));
  CHECK(f64::exposed({glm::dvec3(0), 0}, glm::dvec3(0.3)) == glm::dvec3(0.3));
}

TEST_CASE("exposure: a known exposure is recovered, also if a fifth of the rendering is wrong", "[exposure]") {
  const f64::Exposure exact = fit(tinted_pixels(0), 30);
  auto wrong = tinted_pixels(0.02);
  for (std::size_t i = 0; i < wrong.size(); i += 5)
    wrong[i].colour = glm::dvec3(0.9, 0.1, 0.1);  // as if an object were in front
  const f64::Exposure robust = fit(wrong, 30);
  for (int k = 0; k < 3; ++k) {
    CHECK(exact.gain[k] == Approx(kTinted.gain[k]).margin(2e-3));
    CHECK(robust.gain[k] == Approx(kTinted.gain[k]).margin(0.12));
  }
}

TEST_CASE("exposure: without sufficient data the fit is the start or near it", "[exposure]") {
  const glm::dvec3 start(0.1, -0.2, 0.3);
  CHECK(fit({}, 3, start).gain == start);
  // Saturated photographs give only a bound.
  CHECK(fit({{glm::dvec3(0.7), glm::dvec3(0.5, 0.5, 1)}, {glm::dvec3(0.7), glm::dvec3(0, 0.5, 0.5)}}, 3).gain ==
        glm::dvec3(0));
  // A rendering that explains little of the photograph has little effect.
  soup::Random r(3);
  std::vector<Pixel> noise;
  for (int i = 0; i < 4000; ++i) noise.push_back({random_vector_in(r, 0, 1), random_vector_in(r, 0.1, 0.9)});
  const f64::Exposure little = fit(noise, 10, start);
  for (int k = 0; k < 3; ++k) CHECK(std::abs(little.gain[k] - start[k]) < 0.25);
}

TEST_CASE("exposure: float and double agree", "[exposure]") {
  const auto pixels = tinted_pixels(0.02);
  glm::dvec4 sums[EXPOSURE_SUMS]{};
  glm::vec4 sums_float[EXPOSURE_SUMS]{};
  for (const Pixel& p : pixels) f64::add_to_exposure(p.colour, p.photograph, kTinted, sums);
  for (int i = 0; i < EXPOSURE_SUMS; ++i) sums_float[i] = glm::vec4(sums[i]);
  const f64::Exposure m = f64::fitted_exposure(sums, kTinted, glm::dvec3(0), 1);
  const f32::Exposure n = f32::fitted_exposure(sums_float, {glm::vec3(kTinted.gain), 0}, glm::vec3(0), 1);
  for (int k = 0; k < 3; ++k) CHECK(n.gain[k] == Approx(m.gain[k]).margin(1e-4));
  // Where hardly a pixel is seen, the prior counts for more.
  const f64::Exposure hardly = f64::fitted_exposure(sums, kTinted, glm::dvec3(0), 1e-4);
  CHECK(glm::length(hardly.gain) < 0.9 * glm::length(m.gain));
}

TEST_CASE("exposure: differences are shrunk according to the errors of the fits", "[exposure]") {
  CHECK(f64::exposure_share(0.01, 0.02) == 0);
  CHECK(f64::exposure_share(0.02, 0.02) == 0);
  CHECK(f64::exposure_share(0, 0) == 0);
  CHECK(f64::exposure_share(0.04, 0.01) == Approx(0.75));
  // The variance of a fit is that of ten pixels with its error.
  const double error = 0.03;
  std::vector<Pixel> pixels;
  for (int i = 0; i < 4000; ++i) pixels.push_back({glm::dvec3(0.5), glm::dvec3(0.5 + (i % 2 ? error : -error))});
  CHECK(fit(pixels, 2).variance == Approx(error * error / 10 / 0.0625).epsilon(0.02));
}
