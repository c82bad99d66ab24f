// Tests engine/mesh/decimate_views.cpp and engine/train/start/surface_budget.cpp.
#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "mesh/decimate_views.h"
#include "soup/random.h"
#include "train/start/surface_budget.h"

using namespace trisoup;

namespace {

/// A height field of n x n squares over 0..1, two triangles each.
template <typename F>
soup::Mesh sheet(std::uint32_t n, F&& height) {
  soup::Mesh mesh;
  for (std::uint32_t y = 0; y <= n; ++y)
    for (std::uint32_t x = 0; x <= n; ++x)
      mesh.positions.emplace_back(double(x) / n, double(y) / n, height(double(x) / n, double(y) / n));
  for (std::uint32_t y = 0; y < n; ++y)
    for (std::uint32_t x = 0; x < n; ++x) {
      const std::uint32_t a = y * (n + 1) + x, b = a + 1, c = a + n + 1, d = c + 1;
      mesh.indices.insert(mesh.indices.end(), {a, b, d, a, d, c});
    }
  return mesh;
}

/// A sphere of rings and two poles.
soup::Mesh ball(std::uint32_t rings, std::uint32_t around) {
  soup::Mesh mesh;
  mesh.positions = {{0, 0, 1}, {0, 0, -1}};
  for (std::uint32_t i = 1; i < rings; ++i)
    for (std::uint32_t j = 0; j < around; ++j) {
      const double a = 3.14159265358979 * i / rings, b = 6.28318530717959 * j / around;
      mesh.positions.emplace_back(std::sin(a) * std::cos(b), std::sin(a) * std::sin(b), std::cos(a));
    }
  const auto at = [&](std::uint32_t i, std::uint32_t j) {
    return i == 0 ? 0u : i == rings ? 1u : 2 + (i - 1) * around + j % around;
  };
  for (std::uint32_t i = 0; i < rings; ++i)
    for (std::uint32_t j = 0; j < around; ++j) {
      if (i > 0) mesh.indices.insert(mesh.indices.end(), {at(i, j), at(i + 1, j), at(i, j + 1)});
      if (i + 1 < rings) mesh.indices.insert(mesh.indices.end(), {at(i, j + 1), at(i + 1, j), at(i + 1, j + 1)});
    }
  return mesh;
}

std::vector<double> area_weights(const soup::Mesh& mesh) {
  std::vector<double> weights;
  for (std::size_t k = 0; k < mesh.indices.size(); k += 3) {
    const glm::dvec3 a(mesh.positions[mesh.indices[k]]), b(mesh.positions[mesh.indices[k + 1]]),
        c(mesh.positions[mesh.indices[k + 2]]);
    weights.push_back(glm::length(glm::cross(b - a, c - a)));
  }
  return weights;
}

double area(const soup::Mesh& mesh, const std::vector<std::uint32_t>& indices) {
  double sum = 0;
  for (const double w : area_weights({mesh.positions, indices})) sum += 0.5 * w;
  return sum;
}

/// True if every edge belongs to two triangles, once in each direction.
bool closed(const std::vector<std::uint32_t>& indices) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> sides;
  for (std::size_t k = 0; k < indices.size(); ++k) ++sides[{indices[k], indices[k % 3 == 2 ? k - 2 : k + 1]}];
  return std::all_of(sides.begin(), sides.end(), [&](const auto& s) {
    return s.second == 1 && sides.count({s.first.second, s.first.first}) == 1;
  });
}

}  // namespace

TEST_CASE("a cube is reduced to twelve triangles", "[decimate]") {
  // Six welded sheets of 12 x 12 squares.
  soup::Mesh mesh;
  std::map<std::array<int, 3>, std::uint32_t> numbers;
  const soup::Mesh side = sheet(12, [](double, double) { return 0.0; });
  for (int axis = 0; axis < 3; ++axis)
    for (const int far : {0, 1})
      for (std::size_t k = 0; k < side.indices.size(); ++k) {
        const glm::vec3& p =
            side.positions[side.indices[far == 0 ? k - k % 3 + (3 - k % 3) % 3 : k]];  // reversed winding
        std::array<int, 3> at;
        at[std::size_t(axis)] = 12 * far;
        at[std::size_t((axis + 1) % 3)] = int(std::lround(12 * p.x));
        at[std::size_t((axis + 2) % 3)] = int(std::lround(12 * p.y));
        const auto [found, added] = numbers.emplace(at, std::uint32_t(mesh.positions.size()));
        if (added) mesh.positions.emplace_back(at[0] / 12.0, at[1] / 12.0, at[2] / 12.0);
        mesh.indices.push_back(found->second);
      }
  REQUIRE(closed(mesh.indices));
  const auto indices = soup::decimate_views(mesh, area_weights(mesh), 12);
  CHECK(indices.size() == 36);
  CHECK(closed(indices));
  CHECK(area(mesh, indices) == Approx(6).epsilon(1e-6));
}

TEST_CASE("a ball remains closed and round", "[decimate]") {
  const soup::Mesh mesh = ball(40, 60);
  REQUIRE(closed(mesh.indices));
  for (const std::size_t budget : {1000u, 200u, 20u}) {
    CAPTURE(budget);
    const auto indices = soup::decimate_views(mesh, area_weights(mesh), budget);
    CHECK(indices.size() <= 3 * budget);
    CHECK(indices.empty() == (budget == 0));
    CHECK(indices.size() > 3 * (budget - 3));
    CHECK(closed(indices));
    double volume = 0;
    for (std::size_t k = 0; k < indices.size(); k += 3)
      volume +=
          glm::dot(glm::dvec3(mesh.positions[indices[k]]),
                   glm::cross(glm::dvec3(mesh.positions[indices[k + 1]]), glm::dvec3(mesh.positions[indices[k + 2]]))) /
          6;
    // The missing volume of a ball with corners on its surface is about 46 / n for equilateral triangles (8 pi^2 /
    // sqrt(3) / n).
    CHECK(volume > 4.18879 - 70 / double(budget));
    CHECK(volume < 4.18879);
  }
}

TEST_CASE("errors of a decimated ball grow with the inverse square of its triangles", "[decimate]") {
  const soup::Mesh mesh = ball(60, 90);
  const std::vector<std::size_t> sizes{4000, 2000, 1000, 500};
  const std::vector<double> errors = soup::decimation_errors(mesh, area_weights(mesh), sizes);
  REQUIRE(errors.size() == sizes.size());
  for (std::size_t i = 1; i < sizes.size(); ++i) CHECK(errors[i] / errors[i - 1] == Approx(4).epsilon(0.35));
  // A closed surface keeps two triangles at least.
  CHECK(std::isinf(soup::decimation_errors(mesh, area_weights(mesh), std::vector<std::size_t>{100, 1}).back()));
}

TEST_CASE("a ball has triangles in proportion to the cube root of what they are worth", "[decimate]") {
  // Errors go with the inverse square of the triangles, so that one more saves in proportion to the inverse cube.
  const soup::Mesh mesh = ball(80, 120);
  const auto budget = [&](double scale, double least_shift, std::size_t views = 2) {
    scene::Scene scene;
    scene.train.resize(views);
    for (scene::View& view : scene.train) view.camera.width = view.camera.height = 100;
    std::vector<double> weights = area_weights(mesh);
    for (double& w : weights) w *= scale;
    return static_cast<double>(train::surface_budget(scene, mesh, weights, least_shift, 100, 15'000));
  };
  const double some = budget(2.5e7, 1e-3);
  CHECK((some > 1000 && some < 4000));
  CHECK(budget(2e8, 1e-3) / some == Approx(2).epsilon(0.1));
  CHECK(budget(2.5e7, 8e-3) / some == Approx(0.5).epsilon(0.1));
  CHECK(budget(2.5e7, 1e-3, 16) / some == Approx(0.5).epsilon(0.1));  // as much to see in more photographs
  CHECK(budget(2.5e7, 1e9) == 100);
  CHECK(budget(2.5e7, 1e-12) == 15'000);
}

TEST_CASE("triangles are spent where errors have the largest weight", "[decimate]") {
  // Waves; errors in the left half have a hundred times the weight.
  const soup::Mesh mesh = sheet(60, [](double x, double y) { return 0.03 * std::sin(40 * x) * std::sin(40 * y); });
  std::vector<double> weights = area_weights(mesh);
  const auto left = [&](const std::vector<std::uint32_t>& indices) {
    std::size_t count = 0;
    for (std::size_t k = 0; k < indices.size(); k += 3)
      count +=
          mesh.positions[indices[k]].x + mesh.positions[indices[k + 1]].x + mesh.positions[indices[k + 2]].x < 1.5f;
    return double(count) / double(indices.size() / 3);
  };
  CHECK(left(soup::decimate_views(mesh, weights, 1500)) == Approx(0.5).margin(0.06));
  for (std::size_t f = 0; f < weights.size(); ++f)
    if (f % 120 < 60) weights[f] *= 100;
  CHECK(left(soup::decimate_views(mesh, weights, 1500)) > 0.7);
}

TEST_CASE("the budget is met for any triangles", "[decimate]") {
  soup::Random random(1);
  soup::Mesh mesh;
  for (int i = 0; i < 60; ++i)
    mesh.positions.emplace_back(random.uniform01(), random.uniform01(),
                                random.uniform01() < 0.1 ? 0.0 : random.uniform01());
  mesh.positions.insert(mesh.positions.end(), 5, mesh.positions[7]);  // at the same position
  for (int k = 0; k < 3 * 400; ++k) mesh.indices.push_back(random.below(65));
  mesh.indices.insert(mesh.indices.end(), {60, 61, 62, 60, 61, 62, 62, 61, 60, 7, 60, 61, 3, 3, 4});
  std::vector<double> weights = area_weights(mesh);
  for (std::size_t f = 0; f < weights.size(); f += 3) weights[f] = 0;
  for (const std::size_t budget : {300u, 50u, 7u, 1u, 0u}) {
    const auto indices = soup::decimate_views(mesh, weights, budget);
    CHECK(indices.size() <= 3 * budget);
    for (std::size_t k = 0; k < indices.size(); k += 3)
      CHECK(std::set<std::uint32_t>(indices.begin() + std::ptrdiff_t(k), indices.begin() + std::ptrdiff_t(k) + 3)
                .size() == 3);
    CHECK(indices == soup::decimate_views(mesh, weights, budget));
  }
  // The last edges remove two triangles at a time.
  mesh.indices = {0, 1, 2, 0, 2, 3, 0, 3, 1, 1, 3, 2};
  for (const std::size_t budget : {3u, 2u, 1u}) {
    const std::size_t left = soup::decimate_views(mesh, area_weights(mesh), budget).size() / 3;
    CHECK((left >= 1 && left <= budget));
  }
  // Separate triangles.
  mesh = {};
  for (std::uint32_t i = 0; i < 300; ++i)
    mesh.positions.emplace_back(random.uniform01(), random.uniform01(), random.uniform01()), mesh.indices.push_back(i);
  CHECK(soup::decimate_views(mesh, area_weights(mesh), 1000).size() == 300);
  CHECK(soup::decimate_views(mesh, area_weights(mesh), 40).size() == 120);
  CHECK(soup::decimate_views({}, {}, 10).empty());
}
