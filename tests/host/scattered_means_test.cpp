// Tests engine/mesh/scattered_means.cpp.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>

#include "mesh/scattered_means.h"
#include "soup/random.h"

using namespace trisoup;
using soup::ScatteredMeans;

namespace {

ScatteredMeans::Point point(const glm::vec3& position, float value, float weight = 1) {
  ScatteredMeans::Point p{position, weight, {}};
  p.values.fill(value);
  p.values[1] = 1 - value;
  return p;
}

/// Inverse fourth powers of the exact distances.
double shepard(const std::vector<ScatteredMeans::Point>& points, const glm::vec3& at) {
  double sum = 0, weights = 0;
  for (const ScatteredMeans::Point& p : points) {
    const double w = p.weight / std::pow(double(glm::distance(p.position, at)), 4.0);
    sum += w * p.values[0], weights += w;
  }
  return sum / weights;
}

}  // namespace

TEST_CASE("means of scattered values are close to those with exact distances") {
  soup::Random random(7);
  // Values known on the left of a plane; asked for on its right, near the border and far from it.
  std::vector<ScatteredMeans::Point> points;
  for (int i = 0; i < 4000; ++i) {
    const auto x = static_cast<float>(random.uniform(-1, 0)), y = static_cast<float>(random.uniform(-1, 1));
    points.push_back(point({x, y, 0.1f * x}, 0.5f + 0.4f * std::sin(4 * y), 0.5f + float(random.uniform01())));
  }
  const ScatteredMeans means(points, 0.02f);
  double worst = 0, total = 0;
  for (int i = 0; i < 400; ++i) {
    const glm::vec3 at(random.uniform(0.05, 1), random.uniform(-1, 1), random.uniform(-0.1, 0.1));
    const auto found = means.at(at);
    const double error = std::abs(found[0] - shepard(points, at));
    worst = std::max(worst, error), total += error;
    CHECK(found[0] + found[1] == Approx(1).epsilon(1e-5));
    CHECK(found[2] == found[0]);
  }
  CAPTURE(worst, total / 400);
  CHECK(worst < 0.04);
  CHECK(total / 400 < 0.012);
}

TEST_CASE("near and heavy points count more, and equal values stay what they are") {
  const ScatteredMeans two(std::vector{point({0, 0, 0}, 0), point({1, 0, 0}, 1)}, 0.01f);
  CHECK(two.at({0.5f, 0, 0})[0] == Approx(0.5).epsilon(1e-4));
  CHECK(two.at({0.25f, 0, 0})[0] == Approx(1 / 82.0).epsilon(1e-3));
  CHECK(two.at({0, 0, 0})[0] < 1e-6);
  CHECK(two.at({1, 0, 0})[0] > 1 - 1e-6);
  CHECK(two.at({2, 0, 0})[0] == Approx(16 / 17.0).epsilon(1e-3));
  const ScatteredMeans heavy(std::vector{point({0, 0, 0}, 0, 3), point({1, 0, 0}, 1, 1)}, 0.01f);
  CHECK(heavy.at({0.5f, 0, 0})[0] == Approx(0.25).epsilon(1e-4));

  const ScatteredMeans one(std::vector{point({3, 4, 5}, 0.25f)}, 1);
  CHECK(one.at({-10, 0, 70})[0] == 0.25f);
  CHECK(one.at({3, 4, 5})[0] == 0.25f);
  // At most 2^20 cells along a side: what is asked for is too fine.
  const ScatteredMeans wide(std::vector{point({0, 0, 0}, 0.25f), point({1e6f, 1, -1e6f}, 0.25f)}, 1e-6f);
  for (const float x : {-1e6f, 0.0f, 17.0f, 5e5f, 1e6f}) CHECK(wide.at({x, 0, -x})[0] == Approx(0.25).epsilon(1e-6));
}
