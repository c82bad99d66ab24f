// Tests viewer/navigation.h and viewer/flight.h.
#include <catch2/catch.hpp>

#include <cmath>

#include "viewer/navigation.h"

using namespace trisoup;
using viewer::Navigation;

namespace {

render::Framing framing() { return {{0.1, 0.0, -0.1}, {0, 0, 1}, 1.5, 0.7}; }

scene::Camera a_view() {
  scene::Camera c = render::look_at({1, -0.5, 0.4}, {0.1, 0.1, 0}, {0.05, 0, 1}, 0.9, 640, 480);
  c.cx = 300;
  return c;
}

bool same(const scene::Camera& a, const scene::Camera& b) {
  double error = std::abs(a.fx - b.fx) + std::abs(a.fy - b.fy) + std::abs(a.cx - b.cx) + std::abs(a.cy - b.cy);
  for (int i = 0; i < 4; ++i) error += glm::length(a.world_to_camera[i] - b.world_to_camera[i]);
  return a.width == b.width && a.height == b.height && error < 1e-9;
}

/// Moves in every way.
void wander(Navigation& n) {
  n.orbit(0.4, 0.2);
  n.pan(0.1, -0.2);
  n.zoom(1.5);
  n.fly(0.1, 0.2, 0.3);
  n.set_fov(0.4);
}

glm::dvec2 pixel_of(const scene::Camera& c, const glm::dvec3& point) {
  const glm::dvec3 p(c.world_to_camera * glm::dvec4(point, 1));
  REQUIRE(p.z > 0);
  return {c.cx + c.fx * p.x / p.z, c.cy + c.fy * p.y / p.z};
}

}  // namespace

TEST_CASE("reset returns to the view with which the window began", "[navigation]") {
  Navigation n(framing());
  n.start_at(a_view());
  const scene::Camera first = n.camera(800, 600);
  CHECK(same(first, render::reshaped(a_view(), 800, 600)));
  wander(n);
  REQUIRE(!same(n.camera(800, 600), first));
  n.reset();
  CHECK(same(n.camera(800, 600), first));
  CHECK(n.snapped());
  // Another view of the dataset is not a start.
  scene::Camera other = a_view();
  other.world_to_camera[3].x += 0.5;
  n.snap(other);
  n.reset();
  CHECK(same(n.camera(800, 600), first));
  // Another model begins elsewhere.
  n.set_home(framing());
  CHECK(same(n.camera(800, 600), Navigation(framing()).camera(800, 600)));
}

TEST_CASE("without a first view, reset returns to a place above the soup", "[navigation]") {
  Navigation n(framing());
  const scene::Camera first = n.camera(800, 600);
  wander(n);
  n.snap(a_view());
  n.reset();
  CHECK(same(n.camera(800, 600), first));
  CHECK(!n.snapped());
}

TEST_CASE("a pivot comes to the middle of the picture, and the camera orbits it", "[navigation]") {
  const bool from_view = GENERATE(false, true);
  Navigation n(framing());
  if (from_view) n.start_at(a_view());
  const scene::Camera before = n.camera(800, 600);
  const glm::dvec3 point(0.3, 0.2, 0.1);
  n.pivot(point);
  REQUIRE(n.flying());
  double way = glm::length(pixel_of(n.camera(800, 600), point) - glm::dvec2(400, 300));
  REQUIRE(way > 5);
  int steps = 0;
  for (; n.advance(0.05); ++steps) {
    CHECK(!n.snapped());
    const double left = glm::length(pixel_of(n.camera(800, 600), point) - glm::dvec2(400, 300));
    CHECK(left < way + 1e-9);
    CHECK(left > 0.2 * way);  // no jump
    way = left;
    if (steps > 4) break;
  }
  while (n.advance(0.05)) ++steps;
  CHECK(steps >= 6);
  CHECK(!n.flying());
  CHECK(!n.snapped());
  const scene::Camera after = n.camera(800, 600);
  CHECK(glm::length(pixel_of(after, point) - glm::dvec2(400, 300)) < 1e-6);
  CHECK(glm::length(after.centre() - before.centre()) < 1e-9);
  CHECK(after.fy == Approx(before.fy));
  n.orbit(0.7, -0.2);
  const scene::Camera orbited = n.camera(800, 600);
  CHECK(glm::length(pixel_of(orbited, point) - glm::dvec2(400, 300)) < 1e-6);
  CHECK(glm::length(orbited.centre() - point) == Approx(glm::length(before.centre() - point)));
}

TEST_CASE("a pivot straight above or below the eye, or at it, changes nothing", "[navigation]") {
  Navigation n(framing());
  const scene::Camera before = n.camera(800, 600);
  n.pivot(before.centre());
  n.pivot(before.centre() - glm::dvec3(0, 0, 1));
  CHECK(!n.flying());
  CHECK(!n.advance(1));
  CHECK(same(n.camera(800, 600), before));
}

TEST_CASE("a flight ends exactly at its view, and by hand where it is", "[navigation]") {
  Navigation n(framing());
  const scene::Camera before = n.camera(640, 480);
  n.fly_to(a_view());
  CHECK(same(n.camera(640, 480), before));
  CHECK(!n.snapped());
  CHECK(n.advance(0.3));
  const scene::Camera half = n.camera(640, 480);
  CHECK(!same(half, before));
  CHECK(!same(half, a_view()));
  CHECK(!n.advance(10));
  CHECK(same(n.camera(640, 480), a_view()));
  CHECK(n.snapped());
  n.reset();
  n.fly_to(a_view());
  n.advance(0.3);
  n.zoom(1);
  CHECK(!n.flying());
  CHECK(!n.advance(1));
  CHECK(glm::length(n.camera(640, 480).centre() - half.centre()) < 1e-9);
}

TEST_CASE("a flight leads around what the cameras look at", "[navigation]") {
  // From one side to nearly the opposite one: the straight way leads through the target.
  const auto at = [](double angle) {
    return viewer::Aimed{render::look_at({std::cos(angle), std::sin(angle), 0}, {0, 0, 0}, {0, 0, 1}, 0.8, 64, 48), 1};
  };
  for (double share : {0.0, 0.25, 0.5, 0.75, 1.0})
    CHECK(glm::length(viewer::between(at(0), at(3), share).camera.centre()) == Approx(1));
}
