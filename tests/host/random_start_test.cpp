// Tests engine/train/start/random_start.h, and random.h and decimate.h that it uses.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <set>

#include "base/error.h"
#include "mesh/decimate.h"
#include "mesh/point_spacing.h"
#include "npz.h"
#include "shared_data.h"
#include "soup/random.h"
#include "train/start/random_start.h"

using namespace trisoup;
using namespace trisoup::soup;

namespace {

std::vector<glm::vec3> points_of(const test::Array& array) {
  std::vector<glm::vec3> points;
  for (std::size_t k = 0; k + 2 < array.f.size(); k += 3)
    points.emplace_back(array.f[k], array.f[k + 1], array.f[k + 2]);
  return points;
}

std::vector<glm::vec3> random_points(std::size_t count, std::uint64_t seed) {
  Random random(seed);
  std::vector<glm::vec3> points(count);
  for (glm::vec3& p : points) p = random.in_sphere();
  return points;
}

// Reference implementation without acceleration.
std::vector<std::uint32_t> farthest_points_plainly(const std::vector<glm::vec3>& points, std::size_t count) {
  std::vector<float> distance(points.size(), INFINITY);
  std::vector<std::uint32_t> chosen{0};
  while (chosen.size() < std::min(count, points.size())) {
    for (std::size_t k = 0; k < points.size(); ++k) {
      const glm::vec3 d = points[k] - points[chosen.back()];
      distance[k] = k == chosen.back() ? -1 : std::min(distance[k], d.x * d.x + d.y * d.y + d.z * d.z);
    }
    chosen.push_back(static_cast<std::uint32_t>(std::max_element(distance.begin(), distance.end()) - distance.begin()));
  }
  return chosen;
}

// A sphere of 4 * rings * rings triangles, 4 * rings of which are degenerate at the poles.
Mesh sphere(int rings) {
  Mesh mesh;
  const int around = 2 * rings;
  for (int y = 0; y <= rings; ++y)
    for (int x = 0; x < around; ++x) {
      const double theta = M_PI * y / rings, phi = 2 * M_PI * x / around, radius = y == rings ? 0 : std::sin(theta);
      mesh.positions.emplace_back(radius * std::cos(phi), radius * std::sin(phi), std::cos(theta));
    }
  for (int y = 0; y < rings; ++y)
    for (int x = 0; x < around; ++x) {
      const std::uint32_t a = y * around + x, b = y * around + (x + 1) % around, c = a + around, d = b + around;
      mesh.indices.insert(mesh.indices.end(), {a, c, b, b, c, d});
    }
  return mesh;
}

}  // namespace

TEST_CASE("random numbers: Philox test vectors and resumable streams", "[random]") {
  // Test vectors of Random123.
  CHECK(philox({0, 0, 0, 0}, {0, 0}) == std::array<std::uint32_t, 4>{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8});
  CHECK(philox({~0u, ~0u, ~0u, ~0u}, {~0u, ~0u}) ==
        std::array<std::uint32_t, 4>{0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd});
  CHECK(philox({0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344}, {0xa4093822, 0x299f31d0}) ==
        std::array<std::uint32_t, 4>{0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1});
  Random a(5), b(5), other_seed(6), other_stream(5, 1);
  for (int k = 0; k < 7; ++k) a.bits();
  b.seek(7);
  const std::uint32_t next = a.bits();
  CHECK(b.bits() == next);
  other_seed.seek(7), other_stream.seek(7);
  CHECK(other_seed.bits() != next);
  CHECK(other_stream.bits() != next);
}

TEST_CASE("random numbers: distributions", "[random]") {
  Random random(1);
  constexpr int n = 20'000;
  double sum = 0, squares = 0, radius = 0;
  int counts[7] = {};
  glm::dvec3 axis(0);
  for (int k = 0; k < n; ++k) {
    const float u = random.uniform01();
    REQUIRE((u >= 0 && u < 1));
    sum += u, squares += u * u;
    ++counts[random.below(7)];
    const glm::vec3 p = random.in_sphere();
    REQUIRE(glm::length(p) <= 1.0001f);
    radius += glm::length(p);
    const glm::dmat3 r = random.rotation();
    if (k < 100) {
      CHECK(glm::determinant(r) == Approx(1));
      CHECK(glm::length((glm::transpose(r) * r)[1] - glm::dvec3(0, 1, 0)) < 1e-12);
    }
    axis += r[0];
  }
  CHECK(sum / n == Approx(0.5).margin(0.01));
  CHECK(squares / n == Approx(1.0 / 3).margin(0.01));
  CHECK(radius / n == Approx(0.75).margin(0.01));
  CHECK(glm::length(axis) / n < 0.02);
  for (const int count : counts) CHECK(count == Approx(n / 7.0).epsilon(0.06));
  std::vector<int> order(50);
  for (int k = 0; k < 50; ++k) order[k] = k;
  random.shuffle(std::span(order));
  CHECK_FALSE(std::is_sorted(order.begin(), order.end()));
  CHECK(std::set<int>(order.begin(), order.end()).size() == 50);
  CHECK(random.below(0) == 0);
  CHECK(random.below(1) == 0);
}

TEST_CASE("initial triangles equal the published ones", "[initialise][golden]") {
  REQUIRE_SHARED_FOLDER(shared);
  test::Npz golden = test::load_npz(shared / "golden/E_init.npz");
  const std::vector<glm::vec3> points = points_of(golden["points"]);
  CHECK(mean_nearest_distance(points) == Approx(golden["nn_spacing_mean"].f[0]).epsilon(1e-6));

  const std::vector<std::uint32_t> chosen = farthest_points(points, golden["fps_n"].i[0]);
  const std::vector<std::int32_t>& order = golden["fps_order"].i;
  CHECK(std::vector<std::int32_t>(chosen.begin(), chosen.end()) == order);
  std::vector<std::int32_t> sorted(chosen.begin(), chosen.end());
  std::sort(sorted.begin(), sorted.end());
  CHECK(sorted == golden["fps_sorted"].i);

  const std::vector<glm::vec3> centres = points_of(golden["soup_xyz"]), expected = points_of(golden["soup_V"]);
  const std::vector<float>& u = golden["soup_u"].f;
  float worst = 0;
  for (std::size_t k = 0; k < 40; ++k) {
    const auto triangle =
        equilateral_triangle(centres[k], golden["soup_scale"].f[0], rotation_from_uniforms(u[k], u[40 + k], u[80 + k]));
    for (int corner = 0; corner < 3; ++corner)
      worst = std::max(worst, glm::length(triangle[corner] - expected[3 * k + corner]));
  }
  CHECK(worst <= 1e-5f);
}

TEST_CASE("farthest points equal their definition", "[initialise][same_code]") {
  for (const std::size_t n : {1u, 2u, 127u, 128u, 129u, 3000u}) {
    const std::vector<glm::vec3> points = random_points(n, n);
    for (const std::size_t count : {1u, 2u, 100u, 5000u}) {
      INFO(n << " points, " << count << " asked for");
      CHECK(farthest_points(points, count) == farthest_points_plainly(points, count));
    }
  }
  // On a grid nearly every distance is tied. Every point occurs three times.
  std::vector<glm::vec3> grid;
  for (int k = 0; k < 3 * 512; ++k) grid.emplace_back(k % 8, k / 8 % 8, k / 64 % 8);
  CHECK(farthest_points(grid, 1000) == farthest_points_plainly(grid, 1000));
  const auto all = farthest_points(grid, grid.size() + 5);
  CHECK(std::set<std::uint32_t>(all.begin(), all.end()).size() == grid.size());
  CHECK(farthest_points({}, 3).empty());
  CHECK(farthest_points(grid, 0).empty());
}

TEST_CASE("mean nearest distance counts duplicates as 0", "[initialise]") {
  CHECK(mean_nearest_distance(std::vector<glm::vec3>{{0, 0, 0}, {1, 0, 0}, {3, 0, 0}}) == Approx(4.0 / 3));
  CHECK(mean_nearest_distance(std::vector<glm::vec3>{{0, 0, 0}, {1, 0, 0}, {1, 0, 0}, {1, 0, 0}}) == Approx(0.25));
  CHECK(mean_nearest_distance(std::vector<glm::vec3>(1000, glm::vec3(2))) == 0);
  CHECK(mean_nearest_distance(std::vector<glm::vec3>{{1, 2, 3}}) == 0);
  CHECK(mean_nearest_distance({}) == 0);
}

TEST_CASE("triangles from points: counts, size and seed", "[initialise]") {
  std::vector<glm::vec3> points = random_points(2000, 3);
  FromPoints options;
  options.farthest_count = 200, options.random_count = 100, options.seed = 9;
  const std::vector<glm::vec3> triangles = triangles_from_points(points, options);
  REQUIRE(triangles.size() == 3 * 300);
  std::vector<glm::vec3> centres;
  for (std::size_t t = 0; t < 300; ++t)
    centres.push_back((triangles[3 * t] + triangles[3 * t + 1] + triangles[3 * t + 2]) / 3.0f);
  const double radius = 0.25 * mean_nearest_distance(centres);
  std::set<std::pair<float, float>> places;
  for (std::size_t t = 0; t < 300; ++t) {
    CHECK(glm::distance(triangles[3 * t], centres[t]) == Approx(radius).epsilon(1e-3));
    CHECK(glm::distance(triangles[3 * t], triangles[3 * t + 1]) == Approx(std::sqrt(3.0) * radius).epsilon(1e-3));
    places.emplace(centres[t].x, centres[t].y);
  }
  CHECK(places.size() == 300);  // no point is used twice
  CHECK(triangles_from_points(points, options) == triangles);
  options.seed = 10;
  CHECK(triangles_from_points(points, options) != triangles);

  options.random_count = 100'000;
  CHECK(triangles_from_points(points, options).size() == 3 * 2000);
  points.resize(50);
  points[7].x = NAN;
  CHECK(triangles_from_points(points, options).size() == 3 * 49);
  CHECK_THROWS_AS(triangles_from_points({}, options), Error);
  CHECK_THROWS_AS(triangles_from_points(std::vector<glm::vec3>(9, glm::vec3(1)), options), Error);
}

TEST_CASE("in a cloud of very uneven density triangles have the size of the local spacing", "[initialise]") {
  // A plane seen from its centre, with constant density in the image.
  std::vector<glm::vec3> points;
  Random random(4);
  for (int i = 0; i < 900; ++i) {
    const float r = std::exp2(10 * random.uniform01()), a = 6.2831853f * random.uniform01();
    points.emplace_back(r * std::cos(a), r * std::sin(a), 0);
  }
  FromPoints options;
  const auto radius_near_and_far = [&] {
    const auto triangles = triangles_from_points(points, options);
    double near = 0, far = 0;
    int nears = 0, fars = 0;
    for (std::size_t t = 0; t < triangles.size() / 3; ++t) {
      const glm::vec3 centre = (triangles[3 * t] + triangles[3 * t + 1] + triangles[3 * t + 2]) / 3.0f;
      const double radius = glm::distance(triangles[3 * t], centre);
      if (glm::length(centre) < 4) near += radius, ++nears;
      if (glm::length(centre) > 400) far += radius, ++fars;
    }
    return std::pair(near / nears, far / fars);
  };
  const auto [near, far] = radius_near_and_far();
  CHECK(far > 100 * near);
  options.uneven = 1e9;  // as published
  const auto [published_near, published_far] = radius_near_and_far();
  CHECK(published_near == Approx(0.25 * mean_nearest_distance(points)).epsilon(0.01));
  CHECK(published_far == Approx(published_near).epsilon(0.01));
}

TEST_CASE("triangles in a box", "[initialise]") {
  const auto triangles = triangles_in_box(500, {-1, 0, 2}, {1, 0.5f, 4}, 0.01, 4);
  REQUIRE(triangles.size() == 1500);
  glm::vec3 low(9), high(-9);
  for (std::size_t t = 0; t < 500; ++t) {
    const glm::vec3 centre = (triangles[3 * t] + triangles[3 * t + 1] + triangles[3 * t + 2]) / 3.0f;
    low = glm::min(low, centre), high = glm::max(high, centre);
    CHECK(glm::distance(centre, triangles[3 * t]) == Approx(0.01).epsilon(1e-2));
  }
  CHECK(glm::all(glm::greaterThan(low, glm::vec3(-1.001f, -0.001f, 1.999f))));
  CHECK(glm::all(glm::lessThan(high, glm::vec3(1.001f, 0.501f, 4.001f))));
  CHECK(glm::all(glm::greaterThan(high - low, glm::vec3(1.9f, 0.45f, 1.9f))));
}

TEST_CASE("decimation keeps the budget and the shape", "[initialise]") {
  const Mesh fine = sphere(100);  // 40,000 triangles; those at the poles are degenerate
  for (const std::size_t budget : {20'000u, 1000u, 101u}) {
    const auto triangles = triangles_from_mesh(fine, budget);
    INFO(budget << " -> " << triangles.size() / 3);
    CHECK(triangles.size() <= 3 * budget);
    CHECK(triangles.size() >= 3 * budget * 9 / 10);
    for (const glm::vec3& p : triangles) REQUIRE(glm::length(p) == Approx(1).margin(budget >= 1000 ? 0.01 : 0.3));
  }
  const std::size_t few = triangles_from_mesh(fine, 20).size();
  CHECK((few > 0 && few <= 60));
  CHECK(triangles_from_mesh(sphere(4), 1000).size() == 3 * 48);  // within the budget: only degenerate ones are removed
}

TEST_CASE("decimation of separate triangles falls back to clustering", "[initialise]") {
  Mesh mesh;
  Random random(3);
  for (std::uint32_t t = 0; t < 3000; ++t) {
    const glm::vec3 centre = random.in_sphere();
    for (int k = 0; k < 3; ++k)
      mesh.positions.push_back(centre + 0.2f * random.in_sphere()), mesh.indices.push_back(3 * t + k);
  }
  const auto triangles = triangles_from_mesh(mesh, 500);
  CHECK(triangles.size() <= 1500);
  CHECK(triangles.size() >= 300);
}

TEST_CASE("a mesh without area or with invalid values is an error", "[initialise]") {
  const Mesh flat{std::vector<glm::vec3>(3, glm::vec3(1)), {0, 1, 2}};
  CHECK_THROWS_AS(triangles_from_mesh(flat, 10), Error);
  CHECK_THROWS_AS(triangles_from_mesh(Mesh{}, 10), Error);
  CHECK_THROWS_AS(triangles_from_mesh(Mesh{{{0, 0, 0}}, {0, 1, 2}}, 10), Error);
  CHECK_THROWS_AS(triangles_from_mesh(sphere(5), 0), Error);
}
