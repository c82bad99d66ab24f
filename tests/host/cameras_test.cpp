// Tests engine/render/cameras.h.
#include <catch2/catch.hpp>

#include <cmath>
#include <span>
#include <vector>

#include "render/cameras.h"

using namespace trisoup;

namespace {

/// Projects a point to NDC.
glm::dvec2 project(const scene::Camera& camera, const glm::dvec3& p) {
  const glm::dvec4 clip = scene::clip_from_world(camera, 0.01, 10) * glm::dvec4(p, 1);
  REQUIRE(clip.w > 0);
  return glm::dvec2(clip) / clip.w;
}

}  // namespace

TEST_CASE("look_at has its target in the centre and the up direction upwards", "[cameras]") {
  const glm::dvec3 eye(1, -2, 0.5), target(0.2, 0.1, 0), up(0, 0, 1);
  const scene::Camera c = render::look_at(eye, target, up, 0.8, 320, 200);
  CHECK(glm::length(c.centre() - eye) < 1e-12);
  CHECK(glm::length(project(c, target)) < 1e-12);
  // NDC y points down, like the rows of the image.
  CHECK(project(c, target + 0.1 * up).y < -0.01);
  const glm::dvec3 right = glm::cross(c.forward(), up);
  CHECK(project(c, target + 0.1 * right).x > 0.01);
  // Rotations without reflection.
  CHECK(glm::determinant(glm::dmat3(c.world_to_camera)) == Approx(1));
  // The top of the image is at half the field of view.
  const double distance = glm::length(target - eye);
  const glm::dvec3 above = glm::normalize(glm::cross(right, c.forward())) * distance * std::tan(0.4);
  CHECK(project(c, target + above).y == Approx(-1));
}

TEST_CASE("a reshaped camera keeps its vertical field of view and its centre", "[cameras]") {
  scene::Camera c = render::look_at({0, -1, 0}, {0, 0, 0}, {0, 0, 1}, 0.7, 200, 100);
  c.cx = 90;
  c.cy = 55;
  const glm::dvec3 p(0.1, 0.2, 0.05);
  const glm::dvec2 before = project(c, p), after = project(render::reshaped(c, 1000, 1000), p);
  CHECK(after.y == Approx(before.y));
  // Offset from the centre, in image heights.
  CHECK(0.5 * after.x == Approx(0.5 * before.x * 200 / 100));
}

TEST_CASE("an orbit keeps its height and distance and looks at its target", "[cameras]") {
  render::Framing f;
  f.target = {0.1, 0.2, 0.3};
  f.up = glm::normalize(glm::dvec3(0.2, 1, -0.1));
  f.distance = 1.5;
  const auto cameras = render::orbit(f, 8, 0.3, 0.1, 64, 48);
  REQUIRE(cameras.size() == 8);
  for (const scene::Camera& c : cameras) {
    const glm::dvec3 from = c.centre() - f.target;
    CHECK(glm::length(from) == Approx(1.5));
    CHECK(glm::dot(from, f.up) == Approx(1.5 * std::sin(0.3)));
    CHECK(glm::dot(c.forward(), -from) == Approx(1.5));
  }
  CHECK(glm::length(cameras[0].centre() - cameras[4].centre()) == Approx(3 * std::cos(0.3)));
}

TEST_CASE("hemisphere views are evenly distributed over the upper half", "[cameras]") {
  render::Framing f;
  f.up = {0, 0, 1};
  const auto cameras = render::hemisphere(f, 400, 64, 48);
  glm::dvec3 mean(0);
  int lower_half = 0;
  for (const scene::Camera& c : cameras) {
    CHECK(c.centre().z > 0);
    mean += c.centre() / 400.0;
    lower_half += c.centre().z < 0.5;
  }
  // The area of a sphere is proportional to height.
  CHECK(lower_half == 200);
  CHECK(mean.z == Approx(0.5).margin(1e-3));
  CHECK(std::hypot(mean.x, mean.y) < 0.01);
}

TEST_CASE("framing ignores outliers and considers cameras", "[cameras]") {
  std::vector<glm::vec3> vertices;
  for (int i = 0; i < 1000; ++i)
    vertices.push_back(
        {std::sin(i * 12.9898f) * 0.2f + 0.5f, std::sin(i * 78.233f) * 0.2f, std::sin(i * 37.719f) * 0.2f});
  for (int i = 0; i < 20; ++i) vertices.push_back({100.0f, 100.0f, 100.0f});
  const render::Framing alone = render::frame(vertices, {}, {0, 0, 2});
  CHECK(alone.target.x == Approx(0.5).margin(0.05));
  CHECK(alone.distance < 2);
  CHECK(alone.up.z == Approx(1));
  const std::vector<scene::Camera> cameras{render::look_at({0, -1.2, 0}, {}, {0, 0, 1}, 0.5, 64, 48)};
  const render::Framing with = render::frame(vertices, cameras, {0, 0, 1});
  CHECK(with.distance == Approx(1.2));
  CHECK(with.fov == Approx(0.5));
  CHECK(glm::length(render::mean_up(cameras) - glm::dvec3(0, 0, 1)) < 1e-12);
  CHECK(render::mean_up({}) == glm::dvec3(0, 1, 0));
}

TEST_CASE("the inner box ignores outliers", "[cameras]") {
  std::vector<glm::vec3> vertices;
  for (int i = 0; i < 300; ++i) vertices.emplace_back(i / 299.0f, -i / 299.0f, 0.5f);
  const soup::Box before = soup::inner_box(vertices, 0.01);
  CHECK(before.low.x == Approx(0.01).margin(0.005));
  CHECK(before.high.x == Approx(0.99).margin(0.005));
  CHECK(before.low.y == Approx(-0.99).margin(0.005));
  vertices.back() = {1e6f, -1e6f, 1e6f};
  const soup::Box after = soup::inner_box(vertices, 0.01);
  CHECK(glm::all(glm::lessThan(glm::abs(after.low - before.low), glm::vec3(0.005f))));
  CHECK(glm::all(glm::lessThan(glm::abs(after.high - before.high), glm::vec3(0.005f))));
  CHECK(soup::inner_box({}, 0.01).high == glm::vec3(0.0f));
}

TEST_CASE("cameras along a path are in the middles of its parts", "[cameras]") {
  const glm::dvec3 up(0, 0, 1);
  const std::vector<scene::Camera> stations = {render::look_at({0, -1, 0}, {0, 0, 0}, up, 0.7, 200, 100),
                                               render::look_at({0.5, -1, 0}, {1.5, -1, 0}, up, 0.9, 400, 200),
                                               render::look_at({0.5, 1, 0}, {1.5, 1, 0}, up, 0.9, 400, 200)};
  const auto two = render::along(stations, 2);
  REQUIRE(two.size() == 2);
  CHECK(glm::length(two[0].centre() - glm::dvec3(0.25, -1, 0)) < 1e-12);
  CHECK(glm::length(two[0].forward() - glm::normalize(glm::dvec3(1, 1, 0))) < 1e-12);
  CHECK(two[0].fy == Approx(0.5 * (stations[0].fy + 0.5 * stations[1].fy)));
  CHECK(glm::length(two[1].centre() - glm::dvec3(0.5, 0, 0)) < 1e-12);
  CHECK(glm::length(two[1].forward() - glm::dvec3(1, 0, 0)) < 1e-12);
  for (const scene::Camera& c : two) {
    CHECK(glm::ivec2(c.width, c.height) == glm::ivec2(200, 100));
    CHECK(glm::determinant(glm::dmat3(c.world_to_camera)) == Approx(1));
  }
  const auto one = render::along(std::span(stations).first(1), 3);
  REQUIRE(one.size() == 3);
  CHECK(glm::length(one[2].centre() - stations[0].centre()) < 1e-12);
}
