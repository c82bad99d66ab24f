// Tests engine/train/start/start_points.h and engine/train/start/surface_start.h.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/error.h"
#include "mesh/delaunay.h"
#include "recipe_settings.h"
#include "soup/random.h"
#include "train/start/start_points.h"
#include "train/start/surface_start.h"

using namespace trisoup;
using namespace trisoup::train;

namespace {

/// Cameras on a circle around the origin that look at it, each with an image of one colour.
scene::Scene ring(int cameras, int side = 32) {
  scene::Scene scene;
  for (int i = 0; i < cameras; ++i) {
    const double angle = 6.283 * i / cameras;
    scene::View v;
    v.name = std::to_string(i);
    v.camera.width = v.camera.height = side;
    v.camera.fx = v.camera.fy = side;
    v.camera.cx = v.camera.cy = 0.5 * side;
    const glm::dvec3 z(-std::cos(angle), -std::sin(angle), 0), y(0, 0, -1), x = glm::cross(y, z);
    v.camera.world_to_camera =
        glm::inverse(glm::dmat4(glm::dvec4(x, 0), glm::dvec4(y, 0), glm::dvec4(z, 0), glm::dvec4(-z, 1)));
    v.image = {side, side, {}};
    for (int p = 0; p < side * side; ++p)
      for (const int c : {200, 100, 50, 255}) v.image.rgba.push_back(static_cast<std::uint8_t>(c));
    scene.train.push_back(std::move(v));
  }
  return scene;
}

void add(scene::Points& points, const glm::vec3& p, std::size_t views, float error) {
  points.positions.push_back(p);
  points.errors.push_back(error);
  points.seen_by.emplace_back();
  for (std::uint32_t v = 0; v < views; ++v) points.seen_by.back().push_back(v);
}

void add_ball(scene::Points& points, int count, std::size_t views = 4) {
  soup::Random random(2);
  for (int i = 0; i < count; ++i) add(points, 0.3f * glm::normalize(random.in_sphere()), views, 0.5f);
}

}  // namespace

TEST_CASE("points seen by too few views, with large reprojection error or too far away are dropped", "[start]") {
  scene::Points points;
  add_ball(points, 300);
  add(points, {0.1f, 0, 0}, 2, 0.5f);      // too few views
  add(points, {0.1f, 0.1f, 0}, 5, 3.0f);   // large error
  add(points, {900, 0, 0}, 5, 0.5f);       // too far away
  add(points, {0.2f, 0.1f, 0}, 5, -1.0f);  // unknown error: kept
  const auto chosen = usable_points(points);
  CHECK(chosen.size() == 301);
  CHECK(chosen.back() == 303);
}

TEST_CASE("a measured point is kept if one view sees it", "[start]") {
  scene::Points points;
  add_ball(points, 300);
  add(points, {0.1f, 0, 0}, 1, -1.0f);  // measured
  add(points, {0.1f, 0.1f, 0}, 1, -1.0f);
  add(points, {0.2f, 0.1f, 0}, 0, -1.0f);  // measured, of a view that is held out
  points.measured.resize(303);
  points.measured[300] = points.measured[302] = true;
  const auto chosen = usable_points(points);
  CHECK(chosen.size() == 301);
  CHECK(chosen.back() == 300);
}

TEST_CASE("a sparse but accurate cloud is kept", "[start]") {
  scene::Points points;
  add_ball(points, 90, 2);
  CHECK(usable_points(points).size() == 90);
}

TEST_CASE("of stereo two views suffice, and all distant points stay", "[start]") {
  scene::Points points;
  add_ball(points, 300);
  for (int i = 0; i < 20; ++i) add(points, {0.01f * float(i), 0, 0}, 2, -1.0f);
  points.stereo = true;
  for (int i = 0; i < 10; ++i) add(points, {5000, float(i), 0}, 2, -1.0f);
  points.distant = 10;
  CHECK(usable_points(points).size() == 330);
  const auto few = thinned(points, usable_points(points), 50).chosen;
  CHECK(few.size() <= 60);
  CHECK(std::count_if(few.begin(), few.end(), [](std::uint32_t i) { return i >= 320; }) == 10);
  points.stereo = false;
  CHECK(usable_points(points).size() == 310);
}

TEST_CASE("in a cloud without tracks points far from their neighbours are dropped", "[start]") {
  scene::Points points;
  add_ball(points, 300);
  points.positions.push_back({0.9f, 0.9f, 0});
  points.errors.clear(), points.seen_by.clear();
  const auto chosen = usable_points(points);
  CHECK(chosen.size() < 301);
  CHECK(chosen.size() > 280);
  CHECK(std::count(chosen.begin(), chosen.end(), 300u) == 0);
}

TEST_CASE("of many points those seen by most views are kept, evenly over the scene", "[start]") {
  scene::Points points;
  add_ball(points, 3000, 3);
  for (std::size_t i = 0; i < points.seen_by.size(); i += 10) points.seen_by[i].push_back(7);
  const auto chosen = thinned(points, usable_points(points), 500).chosen;
  REQUIRE(chosen.size() <= 500);
  CHECK(chosen.size() > 300);
  const auto best = std::count_if(chosen.begin(), chosen.end(), [](std::uint32_t i) { return i % 10 == 0; });
  CHECK(best > 150);  // a random choice would give 50
  for (int octant = 0; octant < 8; ++octant)
    CHECK(std::any_of(chosen.begin(), chosen.end(), [&](std::uint32_t i) {
      const glm::vec3& p = points.positions[i];
      return (p.x > 0) == bool(octant & 1) && (p.y > 0) == bool(octant & 2) && (p.z > 0) == bool(octant & 4);
    }));
}

TEST_CASE("points that stand for others have the sightings of all", "[start]") {
  scene::Scene scene;
  scene::Points& points = scene.points;
  // A surface of 99 points in one place, each seen by a view of its own and all by views 0 to 2; and a stray.
  for (std::uint32_t i = 0; i < 99; ++i) {
    points.positions.emplace_back(0.5f + 1e-5f * static_cast<float>(i), 0, 0);
    points.seen_by.push_back({0, 1, 2, 3 + i});
  }
  points.positions.emplace_back(-0.5f, 0, 0);
  points.seen_by.push_back({0, 1, 2});
  std::vector<std::uint32_t> all(100);
  std::iota(all.begin(), all.end(), 0u);
  const Thinned two = thinned(points, all, 2);
  REQUIRE(two.chosen == std::vector<std::uint32_t>{0, 99});
  CHECK(two.cells[0].size() == 99);
  const MergedSightings merged = merged_sightings(scene, two);
  REQUIRE(merged.seen_by[0].size() == 102);
  CHECK(merged.weights[0][0] == Approx(99 / 50.0));  // the mean cell has 50 points
  CHECK(merged.weights[0][3] == 1);
  CHECK(merged.seen_by[1] == std::vector<std::uint32_t>{0, 1, 2});
  CHECK(merged.weights[1] == std::vector<float>{1, 1, 1});
  const Thinned each = thinned(points, all, 100);
  CHECK(each.chosen == all);
  CHECK(merged_sightings(scene, each).seen_by == points.seen_by);
}

TEST_CASE("distant points are never thinned", "[start]") {
  scene::Points points;
  add_ball(points, 500);
  for (int i = 0; i < 20; ++i) points.positions.emplace_back(100 + i, 0, 0), points.seen_by.push_back({0, 1});
  points.errors.clear();
  points.distant = 20;
  const Thinned few = thinned(points, usable_points(points), 50);
  REQUIRE(few.chosen.size() > 20);
  CHECK(few.chosen.size() <= 70);
  for (std::uint32_t i = 0; i < 20; ++i) CHECK(few.chosen[few.chosen.size() - 20 + i] == 500 + i);
}

TEST_CASE("contracted() keeps directions and the order of distances, with radius below 2", "[start]") {
  soup::Random random(3);
  for (int i = 0; i < 100; ++i) {
    const glm::dvec3 p = std::pow(10.0, random.uniform(-2, 4)) * glm::normalize(glm::dvec3(random.in_sphere()));
    CHECK(glm::length(contracted(p)) < 2);
    CHECK(glm::length(contracted(p)) < glm::length(contracted(1.001 * p)));
    CHECK(glm::length(glm::normalize(contracted(p)) - glm::normalize(p)) < 1e-12);
  }
}

TEST_CASE("without tracks, points far behind others count as hidden", "[start]") {
  scene::Scene scene = ring(8);
  // A dense sheet of points between the first camera, at (1, 0, 0), and a point.
  for (int y = -12; y <= 12; ++y)
    for (int z = -12; z <= 12; ++z) scene.points.positions.emplace_back(0.5f, 0.02f * float(y), 0.02f * float(z));
  scene.points.positions.emplace_back(-0.2f, 0, 0);
  std::vector<std::uint32_t> all(scene.points.positions.size());
  std::iota(all.begin(), all.end(), 0u);
  const auto sightings = sightings_of(scene, all);
  CHECK(std::count(sightings.back().begin(), sightings.back().end(), 0u) == 0);
  CHECK(std::count(sightings.back().begin(), sightings.back().end(), 4u) == 1);
  CHECK(std::count(sightings.front().begin(), sightings.front().end(), 0u) == 1);
}

TEST_CASE("a surface start respects the number of triangles and has colours and a backdrop", "[start]") {
  scene::Scene scene = ring(8);
  add_ball(scene.points, 800, 8);
  Settings settings = test::settings_of_recipe(Recipe::real);
  settings.triangles = 500;
  settings.backdrop = 9;
  const Start start = surface_start(scene, settings);
  const std::size_t triangles = start.vertices.size() / 3;
  CHECK(triangles <= 500);
  CHECK(triangles > 300);
  REQUIRE(start.colours.size() == start.vertices.size());
  std::size_t behind = 0, in_colour = 0;
  for (std::size_t i = 0; i < start.vertices.size(); ++i) {
    const bool grey = start.colours[i] == glm::vec3(0.5f);  // not in any photograph
    CHECK((grey || glm::length(start.colours[i] - glm::vec3(200, 100, 50) / 255.0f) < 1e-5f));
    in_colour += !grey;
    behind += glm::length(start.vertices[i]) > 8.9f;
  }
  CHECK(behind == 3 * 80);
  CHECK(in_colour > 600);
  CHECK_THROWS_AS(surface_start(ring(4), settings), Error);
}

TEST_CASE("a surface has as many triangles as shift its photographs", "[start]") {
  const auto budget_of = [](double size, double least_shift, std::uint32_t most = 4000) {
    scene::Scene scene = ring(8);
    for (scene::View& view : scene.train) {
      view.camera = scene::resized(view.camera, int(640 * size), int(480 * size));
      view.image = {};
    }
    soup::Random random(6);
    for (int i = 0; i < 6000; ++i) {
      const glm::vec3 normal = glm::normalize(random.in_sphere());
      add(scene.points, glm::dvec3(0.5f * normal), 0, 0.5f);
      for (std::uint32_t v = 0; v < 8; ++v)
        if (glm::dot(scene.train[v].camera.centre() - glm::dvec3(0.5f * normal), glm::dvec3(normal)) > 0)
          scene.points.seen_by.back().push_back(v);
    }
    Settings settings = test::settings_of_recipe(Recipe::real);
    settings.init = "surface";
    settings.triangles = settings.init_count = most;
    settings.least_shift = least_shift;
    const Start start = initial_triangles(scene, settings);
    take_budget(settings, start);
    CHECK(settings.triangles == start.vertices.size() / 3);
    CHECK(settings.init_count == settings.triangles);
    return double(settings.triangles);
  };
  const double some = budget_of(1, 1e-2);
  CHECK((some > 1000 && some < 3500));
  CHECK(budget_of(2, 1e-2) > 1.2 * some);
  CHECK(budget_of(1, 0.1) < 0.8 * some);
  CHECK(budget_of(1, 1e6) == 500);
  CHECK(budget_of(1, 1e-9) == 4000);
  CHECK(budget_of(1, 1e-9, 800) == 800);
}

TEST_CASE("far points are drawn in, in order", "[start]") {
  soup::Random random(5);
  std::vector<glm::dvec3> points;
  for (int i = 0; i < 1000; ++i) points.emplace_back(glm::normalize(random.in_sphere()));
  for (int i = 0; i < 20; ++i) points.push_back(std::pow(2.0, i) * glm::normalize(glm::dvec3(1, 2, 3)));
  const std::vector<glm::dvec3> cameras{{2, 0, 0}};
  const auto near = drawn_in(points, cameras);
  REQUIRE(near.size() == points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (glm::length(points[i]) < 16) CHECK(near[i] == points[i]);
    CHECK(glm::length(glm::normalize(near[i]) - glm::normalize(points[i])) < 1e-12);
    if (i > 1000) CHECK(glm::length(near[i]) > glm::length(near[i - 1]));
  }
  CHECK(glm::length(points.back()) > 500'000);
  CHECK(glm::length(near.back()) < 200);
}

TEST_CASE("a measured sky does not move what is near", "[start]") {
  // A depth map gives the sky one depth, that of the far plane.
  soup::Random random(5);
  std::vector<glm::dvec3> points;
  for (const double depth : {0.0, 5000.0})
    for (int i = 0; i < 2000; ++i)
      points.push_back(std::max(1.0, depth) * glm::dvec3(random.uniform(-1, 1), random.uniform(-1, 1), depth > 0));
  const std::vector<glm::dvec3> cameras{{1.5, 0, 0}};
  const std::vector<glm::dvec3> jittered = soup::delaunay(drawn_in(points, cameras)).points;
  double moved = 0;
  for (std::size_t i = 0; i < 2000; ++i) moved = std::max(moved, glm::distance(jittered[i], points[i]));
  CHECK(moved < 1e-4);
}

TEST_CASE("a surface start puts triangles where photographs show most detail", "[start]") {
  scene::Scene scene = ring(8);
  // Two equal balls; each point is seen by the cameras in front of it.
  soup::Random random(4);
  for (int i = 0; i < 1500; ++i) {
    const glm::vec3 normal = glm::normalize(random.in_sphere());
    for (const float z : {0.0f, 4.0f}) {
      const glm::dvec3 p(0.3f * normal + glm::vec3(0, 0, z));
      add(scene.points, p, 0, 0.5f);
      for (std::uint32_t v = 0; v < 8; ++v)
        if (glm::dot(scene.train[v].camera.centre() - p, glm::dvec3(normal)) > 0)
          scene.points.seen_by.back().push_back(v);
    }
  }
  Settings settings = test::settings_of_recipe(Recipe::real);
  settings.triangles = 600;
  settings.backdrop = 15;
  const Start start = surface_start(scene, settings);
  const auto around = [&](const glm::vec3& middle) {
    std::size_t count = 0;
    for (std::size_t i = 0; i < start.vertices.size(); i += 3) count += glm::distance(start.vertices[i], middle) < 0.5f;
    return count;
  };
  // At a distance of 4.1 a squared error is 1/280 of that at distance 1.
  CHECK(around({0, 0, 4}) > 10);
  CHECK(around({0, 0, 0}) > 4 * around({0, 0, 4}));
}

TEST_CASE("the backdrop is closed and lies around the origin", "[start]") {
  const std::vector<glm::vec3> triangles = backdrop_triangles(5);
  REQUIRE(triangles.size() == 240);
  double area = 0;
  for (std::size_t k = 0; k < triangles.size(); k += 3) {
    area += 0.5 * glm::length(glm::cross(triangles[k + 1] - triangles[k], triangles[k + 2] - triangles[k]));
    for (std::size_t e = 0; e < 3; ++e) CHECK(glm::length(triangles[k + e]) == Approx(5));
  }
  CHECK(area == Approx(4 * 3.14159265 * 25).epsilon(0.1));
}
