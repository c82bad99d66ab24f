// Tests engine/scene/lens/lens.h and undistort.h.
#include <catch2/catch.hpp>

#include <cmath>

#include "scene/lens/undistort.h"

using namespace trisoup::scene;

namespace {

// An image whose colours are its pixel coordinates, so that a sample shows its position.
Photograph coordinates(int width, int height) {
  Photograph photograph{width, height, {}, {}};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) photograph.colour.emplace_back(2 * x, 2 * y, 0, 255);
  return photograph;
}

}  // namespace

TEST_CASE("Brown-Conrady matches its formula", "[scene][undistort]") {
  Lens lens;
  CHECK(lens.is_pinhole());
  lens.radial = {0.1, -0.05, 0.02, 0};
  lens.p1 = 0.003, lens.p2 = -0.002;
  CHECK_FALSE(lens.is_pinhole());
  const double x = 0.3, y = -0.5, r2 = x * x + y * y;
  const double radial = 1 + 0.1 * r2 - 0.05 * r2 * r2 + 0.02 * r2 * r2 * r2;
  const glm::dvec2 distorted = lens.distort({x, y});
  CHECK(distorted.x == Approx(x * radial + 2 * 0.003 * x * y - 0.002 * (r2 + 2 * x * x)));
  CHECK(distorted.y == Approx(y * radial + 0.003 * (r2 + 2 * y * y) + 2 * -0.002 * x * y));
  lens.denominator = {0.2, 0, 0};
  lens.p1 = lens.p2 = 0;
  CHECK(lens.distort({x, y}).x == Approx(x * radial / (1 + 0.2 * r2)));
}

TEST_CASE("Kannala-Brandt matches its formula and is never treated as a pinhole", "[scene][undistort]") {
  Lens lens;
  lens.model = Lens::Model::fisheye;
  CHECK_FALSE(lens.is_pinhole());
  const glm::dvec2 equidistant = lens.distort({1.0, 0.0});
  CHECK(equidistant.x == Approx(std::atan(1.0)));
  CHECK(equidistant.y == 0.0);
  lens.radial = {0.05, -0.01, 0.003, -0.001};
  const double t = std::atan(0.5);
  CHECK(lens.distort({0.3, 0.4}).y ==
        Approx(0.8 * t * (1 + 0.05 * t * t - 0.01 * std::pow(t, 4) + 0.003 * std::pow(t, 6) - 0.001 * std::pow(t, 8))));
  CHECK(lens.distort({0, 0}) == glm::dvec2(0, 0));
}

TEST_CASE("undistortion samples where the lens projects the ray", "[scene][undistort]") {
  const Camera camera{100, 80, 70, 75, 48, 43, glm::dmat4(1.0)};
  Lens lens;
  lens.radial = {-0.12, 0.03, 0, 0};
  lens.p1 = 0.001;
  const bool fisheye = GENERATE(false, true);
  if (fisheye) lens = Lens{Lens::Model::fisheye, {0.02, 0, 0, 0}, {}, 0, 0, {}, {}};
  const Photograph result = undistort(coordinates(100, 80), camera, lens);
  CHECK(result.inside.empty());  // a lens with barrel distortion covers all of the pinhole image
  for (const auto& [x, y] : {std::pair(10, 10), std::pair(50, 40), std::pair(90, 70), std::pair(99, 0)}) {
    const glm::dvec2 ray((x + 0.5 - 48) / 70, (y + 0.5 - 43) / 75);
    const glm::dvec2 source = lens.distort(ray) * glm::dvec2(70, 75) + glm::dvec2(48, 43);
    const glm::u8vec4 colour = result.colour[std::size_t(y * 100 + x)];
    CHECK(std::abs(colour.r / 2.0 - (source.x - 0.5)) < 0.3);
    CHECK(std::abs(colour.g / 2.0 - (source.y - 0.5)) < 0.3);
  }
}

TEST_CASE("pixels beyond the photograph are masked", "[scene][undistort]") {
  const Camera camera{100, 80, 70, 70, 50, 40, glm::dmat4(1.0)};
  Lens lens;
  lens.radial = {0.2, 0, 0, 0};
  const Photograph result = undistort(coordinates(100, 80), camera, lens);
  REQUIRE(result.inside.size() == 8000);
  CHECK(result.inside[0] == 0);
  CHECK(result.inside[40 * 100 + 50] == 255);
  CHECK(result.colour[0] == glm::u8vec4(0));
}

TEST_CASE("a polynomial that is not monotonic does not repeat the image", "[scene][undistort]") {
  Lens lens;
  lens.radial = {-0.4, 0, 0, 0};  // r (1 - 0.4 r^2) increases up to r = 0.9129
  CHECK(lens.growing_until(3.0) == Approx(std::sqrt(1 / 1.2)).margin(0.002));
  CHECK(lens.growing_until(0.5) == 0.5);
  const Camera camera{100, 100, 30, 30, 50, 50, glm::dmat4(1.0)};
  const Photograph result = undistort(coordinates(100, 100), camera, lens);
  REQUIRE(result.inside.size() == 10000);
  CHECK(result.inside[50 * 100 + 76] == 255);  // r = 0.88
  CHECK(result.inside[50 * 100 + 79] == 0);    // r = 0.98
  CHECK(result.inside[50 * 100 + 95] == 0);    // would map to the inside again
}

TEST_CASE("lenses with a closed inverse are undone by it", "[scene][undistort]") {
  const auto lens = [](Lens::Model model, double first, double second = 0) {
    Lens result;
    result.model = model;
    result.radial = {first, second, 0, 0};
    return result;
  };
  for (const double q : {1e-9, 0.01, 0.2, 0.6, 0.9}) {
    for (const double omega : {1e-9, 0.01, 0.9, 1.4})
      CHECK(lens(Lens::Model::field_of_view, omega).distort_radius(std::tan(q * omega) / (2 * std::tan(0.5 * omega))) ==
            Approx(q).epsilon(1e-9));
    for (const double k : {-0.9, -0.25, 0.0, 1e-12, 0.3, 1.2})
      CHECK(lens(Lens::Model::division, k).distort_radius(q / (1 + k * q * q)) == Approx(q).epsilon(1e-9));
    for (const double alpha : {0.0, 0.4, 0.6, 0.8}) {
      const double beta = 1.1, root = std::sqrt(1 - (2 * alpha - 1) * beta * q * q);
      const double depth = (1 - alpha * alpha * beta * q * q) / (alpha * root + 1 - alpha);
      CHECK(lens(Lens::Model::unified, alpha, beta).distort_radius(q / depth) == Approx(q).epsilon(1e-9));
    }
    for (const double k : {-0.1, 0.0, 0.2})
      CHECK(lens(Lens::Model::f_theta, k).distort_radius(std::tan(q * (1 + k * q))) == Approx(q).epsilon(1e-9));
  }
  CHECK(lens(Lens::Model::field_of_view, 0).is_pinhole());
  CHECK(lens(Lens::Model::division, 0).is_pinhole());
  CHECK(lens(Lens::Model::unified, 0, 1).is_pinhole());
  CHECK_FALSE(lens(Lens::Model::f_theta, 0).is_pinhole());
  CHECK(std::isnan(lens(Lens::Model::f_theta, -0.5).distort_radius(std::tan(0.6))));  // q - q^2 / 2 is at most 0.5
  CHECK(std::isnan(lens(Lens::Model::division, 0.3).distort_radius(1)));  // beyond the largest radius of the model
}

TEST_CASE("the radius at which a lens folds over", "[scene][undistort]") {
  Lens lens;
  CHECK_FALSE(lens.folds_at());
  lens.radial = {-0.4, 0, 0, 0};  // r (1 - 0.4 r^2) has its maximum at r = 0.9129
  REQUIRE(lens.folds_at());
  CHECK(*lens.folds_at() == Approx(2.0 / 3 * std::sqrt(1 / 1.2)).epsilon(1e-5));
  lens.model = Lens::Model::fisheye;
  lens.radial = {0.1, 0, 0, 0};
  CHECK_FALSE(lens.folds_at());
  lens.radial = {-0.4, 0, 0, 0};
  CHECK(*lens.folds_at() == Approx(2.0 / 3 * std::sqrt(1 / 1.2)).epsilon(1e-5));
}

TEST_CASE("masked pixels do not bleed into their neighbours", "[scene][undistort]") {
  Photograph photograph{40, 40, std::vector<glm::u8vec4>(1600, glm::u8vec4(100, 100, 100, 255)),
                        std::vector<std::uint8_t>(1600, 255)};
  for (std::size_t i = 0; i < 1600; ++i)
    if (i % 40 >= 20) photograph.colour[i] = {255, 0, 0, 255}, photograph.inside[i] = 0;
  Lens lens;
  lens.radial = {-0.1, 0, 0, 0};
  const Photograph result = undistort(photograph, {40, 40, 30, 30, 20, 20, glm::dmat4(1.0)}, lens);
  for (std::size_t i = 0; i < 1600; ++i)
    if (result.inside[i] != 0) CHECK(result.colour[i] == glm::u8vec4(100, 100, 100, 255));
  CHECK(result.inside[20 * 40 + 5] == 255);
  CHECK(result.inside[20 * 40 + 35] == 0);
}
