// Tests engine/scene/up_direction.h and engine/scene/ground_planes.h on synthetic rigs. Z is up in all of them.
#include <catch2/catch.hpp>

#include <cmath>
#include <numbers>
#include <random>

#include "render/cameras.h"
#include "run/model_options.h"
#include "scene/ground_planes.h"
#include "scene/normalisation.h"
#include "scene/up_direction.h"

using namespace trisoup;
using scene::Camera;

namespace {

constexpr double kDegree = std::numbers::pi / 180;

// Deterministic on all platforms, unlike the standard distributions.
class UpNoise {
 public:
  double uniform(double low, double high) { return low + (high - low) * double(engine_() - 1) / 2147483645.0; }
  /// About normal, with this standard deviation.
  double spread(double deviation) {
    double sum = 0;
    for (int i = 0; i < 12; ++i) sum += uniform(-0.5, 0.5);
    return deviation * sum;
  }

 private:
  std::minstd_rand engine_{7};
};

/// Turns a camera about its optical axis.
Camera rolled(const Camera& camera, double degrees) {
  const double c = std::cos(degrees * kDegree), s = std::sin(degrees * kDegree);
  Camera result = camera;
  glm::dmat4 turn(1.0);
  turn[0][0] = c, turn[0][1] = s, turn[1][0] = -s, turn[1][1] = c;
  result.world_to_camera = turn * camera.world_to_camera;
  return result;
}

/// A level camera. yaw: degrees from +X towards +Y. pitch: degrees above the horizon.
Camera level(const glm::dvec3& eye, double yaw, double pitch, double roll = 0) {
  const double a = yaw * kDegree, e = pitch * kDegree;
  const glm::dvec3 ahead(std::cos(a) * std::cos(e), std::sin(a) * std::cos(e), std::sin(e));
  // Unlike +Z, this is never parallel to the viewing direction.
  const glm::dvec3 up(-std::cos(a) * std::sin(e), -std::sin(a) * std::sin(e), std::cos(e));
  return rolled(render::look_at(eye, eye + ahead, up, 0.8, 64, 48), roll);
}

/// Cameras on a circle of radius 3 that look at the origin from `elevation` degrees, held with some roll.
std::vector<Camera> ring(double from, double to, int count, double elevation, double roll = 3) {
  UpNoise noise;
  std::vector<Camera> cameras;
  for (int i = 0; i < count; ++i) {
    const double yaw = from + (to - from) * (count > 1 ? i / (count - 1.0) : 0.5);
    const double a = yaw * kDegree, e = elevation * kDegree;
    const glm::dvec3 eye = 3.0 * glm::dvec3(std::cos(a) * std::cos(e), std::sin(a) * std::cos(e), std::sin(e));
    cameras.push_back(level(eye, yaw + 180, -elevation, noise.spread(roll)));
  }
  return cameras;
}

/// A floor of 8 x 8 at this height with a box and things on it.
std::vector<glm::dvec3> on_floor(double height, int count = 600) {
  UpNoise noise;
  std::vector<glm::dvec3> points;
  for (int i = 0; i < count; ++i)
    if (i % 2 == 0)
      points.emplace_back(noise.uniform(-4, 4), noise.uniform(-4, 4), height + noise.spread(0.01));
    else
      points.emplace_back(noise.spread(0.4), noise.spread(0.4), height + noise.uniform(0, 0.8));
  return points;
}

/// The angle in degrees between +Z and the direction that is found. Normalises as scene::load does.
double error_of(const std::vector<Camera>& cameras, const std::vector<glm::dvec3>& points = {},
                const std::vector<int>& orientations = {}) {
  scene::PointCloud cloud;
  cloud.positions = points;
  const scene::Normalisation normalisation = scene::find_normalisation(cameras, cloud, "rig");
  std::vector<Camera> moved;
  for (const Camera& c : cameras) moved.push_back(scene::normalised(c, normalisation));
  std::vector<glm::vec3> positions;
  for (const glm::dvec3& p : points) positions.emplace_back(normalisation.to_normalised(p));
  const scene::UpDirection up = scene::up_direction(moved, orientations, positions);
  INFO(up.reason);
  CHECK(glm::length(up.direction) == Approx(1));
  CHECK((up.reason.empty()) == (glm::length(up.direction - render::mean_up(moved)) < 1e-12));
  return std::acos(std::clamp(up.direction.z, -1.0, 1.0)) / kDegree;
}

std::vector<Camera> all_rolled(std::vector<Camera> cameras, double degrees) {
  for (Camera& c : cameras) c = rolled(c, degrees);
  return cameras;
}

}  // namespace

TEST_CASE("a full ring keeps the mean of its cameras", "[scene][up]") {
  for (const double elevation : {0.0, 20.0, 60.0}) CHECK(error_of(ring(0, 337, 16, elevation)) < 3);
  CHECK(error_of(ring(0, 337, 16, 20), on_floor(-0.5)) < 3);
}

TEST_CASE("part of a ring that looks down has its up direction from level axes", "[scene][up]") {
  for (const double degrees : {60.0, 90.0, 180.0, 270.0})
    for (const double elevation : {20.0, 45.0, 68.0}) {
      CAPTURE(degrees, elevation);
      if (degrees > 60 || elevation < 60) CHECK(error_of(ring(10, 10 + degrees, 16, elevation, 1)) < 6);
      CHECK(error_of(ring(10, 10 + degrees, 16, elevation, 1), on_floor(-0.5)) < 4);
    }
}

TEST_CASE("cameras that look the same way take the tilt from the ground", "[scene][up]") {
  std::vector<Camera> cameras;
  for (int i = 0; i < 12; ++i) cameras.push_back(level({0.1 * i, -3, 1.5}, 90 + 0.3 * i, -28));
  CHECK(error_of(cameras) == Approx(28).margin(3));
  CHECK(error_of(cameras, on_floor(-0.1)) < 3);
}

TEST_CASE("portrait and landscape photographs may be mixed", "[scene][up]") {
  std::vector<Camera> some = ring(0, 337, 16, 20), half = ring(0, 120, 16, 20), most = ring(0, 337, 16, 20);
  for (std::size_t i = 0; i < 16; ++i) {
    if (i % 3 == 0) some[i] = rolled(some[i], 90);
    if (i % 2 == 0) half[i] = rolled(half[i], -90);
    if (i % 3 > 0) most[i] = rolled(most[i], 90);
  }
  CHECK(error_of(some) < 3);
  CHECK(error_of(half) < 5);
  CHECK(error_of(most) < 3);
}

TEST_CASE("portrait photographs that are stored as landscape", "[scene][up]") {
  // The top of the scene is at the left of the stored photograph (EXIF 6), or at its right (EXIF 8).
  for (const auto& [orientation, roll] : {std::pair(6, -90.0), {8, 90.0}, {3, 180.0}}) {
    CAPTURE(orientation);
    const std::vector<int> tags(16, orientation);
    CHECK(error_of(all_rolled(ring(0, 337, 16, 20), roll), {}, tags) < 3);
    CHECK(error_of(all_rolled(ring(0, 40, 16, 0), roll), {}, tags) < 5);
    CHECK(error_of(all_rolled(ring(0, 90, 16, 50), roll), {}, tags) < 5);
    if (orientation == 3) continue;
    // Without the tag, too, a ring has only one direction that is level for all cameras.
    CHECK(error_of(all_rolled(ring(0, 337, 16, 20), roll)) < 3);
    CHECK(error_of(all_rolled(ring(0, 120, 16, 10), roll), on_floor(-0.5)) < 5);
  }
  // A wrong tag does not turn a ring that is upright without it.
  CHECK(error_of(ring(0, 337, 16, 20), {}, std::vector<int>(16, 6)) < 3);
}

TEST_CASE("drones that look straight down", "[scene][up]") {
  UpNoise noise;
  std::vector<Camera> turning, lanes, fixed, few;
  for (int i = 0; i < 30; ++i) {
    const int lane = i / 6, along = lane % 2 ? 5 - i % 6 : i % 6;
    const glm::dvec3 eye(0.6 * along - 1.5, 0.6 * lane - 1.2, 3);
    const double tilt = -88 + noise.spread(1.5);
    turning.push_back(level(eye, 47.0 * i, tilt));
    lanes.push_back(level(eye, lane % 2 ? 180 : 0, tilt));
    fixed.push_back(level(eye, 0, tilt));
  }
  CHECK(error_of(turning) < 4);
  CHECK(error_of(turning, on_floor(0)) < 4);
  CHECK(error_of(lanes, on_floor(0)) < 4);
  CHECK(error_of(fixed, on_floor(0)) < 4);
}

TEST_CASE("a facade stays upright", "[scene][up]") {
  UpNoise noise;
  std::vector<glm::dvec3> wall;
  for (int i = 0; i < 500; ++i) wall.emplace_back(noise.uniform(-4, 4), noise.spread(0.01), noise.uniform(0, 4));
  std::vector<Camera> walk, handheld;
  for (int i = 0; i < 20; ++i) {
    walk.push_back(level({0.3 * i - 3, -3, 1.6 + noise.spread(0.1)}, 90, noise.spread(3), noise.spread(2)));
    handheld.push_back(level({0.1 * (i % 5), -3, 1.5 + 0.2 * (i / 5)}, 90, noise.spread(3), noise.spread(6)));
  }
  CHECK(error_of(walk, wall) < 4);
  CHECK(error_of(handheld, wall) < 5);
  // A wall does not become ground because the photographs are badly rolled: by 10 degrees. (By 25 degrees, portrait and
  // landscape are confused in 8 of 40 such rigs.)
  std::vector<Camera> careless;
  for (int i = 0; i < 20; ++i) {
    const double height = 1.6 + noise.spread(0.1), pitch = noise.spread(1), roll = noise.spread(10);
    careless.push_back(level({0.2 * i - 2, -3, height}, 90, pitch, roll));
  }
  CHECK(error_of(careless, wall) < 15);
}

TEST_CASE("the ground overrules cameras that are upside down, but a ceiling does not", "[scene][up]") {
  const std::vector<Camera> around = all_rolled(ring(0, 337, 16, 21), 180);
  CHECK(error_of(around) > 170);
  CHECK(error_of(around, on_floor(-0.6)) < 3);
  CHECK(error_of(all_rolled(ring(0, 120, 16, 30), 180), on_floor(-0.6)) < 5);
  // A room with a painted ceiling and a plain floor.
  UpNoise noise;
  std::vector<glm::dvec3> room;
  for (int i = 0; i < 600; ++i)
    if (i % 3 == 0)
      room.emplace_back(i % 2 ? 4 : -4, noise.uniform(-4, 4), noise.uniform(0.5, 3));
    else
      room.emplace_back(noise.uniform(-4, 4), noise.uniform(-4, 4), 3 + noise.spread(0.01));
  std::vector<Camera> inside;
  for (int i = 0; i < 24; ++i)
    inside.push_back(level({noise.uniform(-2, 2), noise.uniform(-2, 2), 1.5}, 15.0 * i, 20 + noise.spread(8)));
  CHECK(error_of(inside, room) < 3);
  // A ring around a chandelier: the walls go on below the cameras.
  std::vector<Camera> below = ring(0, 337, 16, -20);
  std::vector<glm::dvec3> hall;
  for (int i = 0; i < 600; ++i)
    if (i % 3 == 0)
      hall.emplace_back(noise.uniform(-4, 4), noise.uniform(-4, 4), 0.5 + noise.spread(0.01));
    else
      hall.emplace_back(i % 2 ? 4 : -4, noise.uniform(-4, 4), noise.uniform(-2.5, 0.5));
  CHECK(error_of(below, hall) < 3);
}

TEST_CASE("walks, domes and single cameras", "[scene][up]") {
  UpNoise noise;
  std::vector<Camera> walk, dome, outwards;
  for (int i = 0; i < 60; ++i) {
    walk.push_back(
        level({0.2 * i, noise.spread(0.1), 1.6}, noise.uniform(-60, 60), -15 + noise.spread(10), noise.spread(4)));
    const double z = (i + 0.5) / 60, yaw = 137.5 * i, r = std::sqrt(1 - z * z);
    dome.push_back(level({3 * r * std::cos(yaw * kDegree), 3 * r * std::sin(yaw * kDegree), 3 * z}, yaw + 180,
                         -std::asin(z) / kDegree));
    outwards.push_back(level({0.1 * r * std::cos(yaw * kDegree), 0.1 * r * std::sin(yaw * kDegree), 0.1 * z}, yaw,
                             std::asin(1.8 * z - 0.9) / kDegree));
  }
  CHECK(error_of(walk) < 4);
  CHECK(error_of(walk, on_floor(0)) < 4);
  CHECK(error_of(dome) < 3);
  CHECK(error_of(outwards) < 3);
  CHECK(error_of({level({0, -3, 0}, 90, 0)}) < 1e-6);
  CHECK(error_of({level({0, -3, 0}, 90, 0), level({1, -3, 0}, 95, 0)}) < 1);
  // A few views above one another are not taken for portrait photographs side by side.
  CHECK(error_of({level({0, -3, -2.2}, 90, 36), level({0, -3, 2.2}, 90, -36)}) < 1);
  CHECK(scene::up_direction({}, {}, {}).direction == glm::dvec3(0, 1, 0));
}

TEST_CASE("the up direction does not depend on chance", "[scene][up]") {
  const std::vector<Camera> cameras = ring(0, 90, 16, 60);
  std::vector<glm::vec3> points;
  for (const glm::dvec3& p : on_floor(-0.3)) points.emplace_back(p / 3.0);
  const glm::dvec3 first = scene::up_direction(cameras, {}, points).direction;
  CHECK(first == scene::up_direction(cameras, {}, points).direction);
}

TEST_CASE("degenerate cameras and points give a unit vector", "[scene][up]") {
  const Camera one = level({0, -1, 0}, 90, 0), behind = level({0, 1, 0}, -90, 0);
  const std::vector<std::vector<Camera>> rigs{
      {one, one}, {one, rolled(one, 180)}, {one, rolled(one, 90), rolled(one, 180), rolled(one, 270)}, {one, behind}};
  std::vector<glm::vec3> line, far(100, glm::vec3(1e17f));
  for (int i = 0; i < 100; ++i) line.emplace_back(0.01f * static_cast<float>(i), 0.0f, 0.0f);
  for (const std::vector<Camera>& rig : rigs)
    for (const std::vector<glm::vec3>& points : {std::vector<glm::vec3>{}, line, far}) {
      const scene::UpDirection up = scene::up_direction(rig, {}, points);
      CHECK(glm::length(up.direction) == Approx(1));
      CHECK(up.direction == scene::up_direction(rig, {}, points).direction);
    }
}

TEST_CASE("the ground has the cameras on one side", "[scene][up]") {
  std::vector<glm::vec3> points;
  for (const glm::dvec3& p : on_floor(-0.25)) points.emplace_back(0.5 * p);
  const std::vector<glm::dvec3> above{{1, 0, 1}, {0, 1, 1}}, both{{1, 0, 1}, {0, 1, -1}};
  const auto planes = scene::ground_planes(points, above);
  REQUIRE(!planes.empty());
  CHECK(planes[0].normal.z > 0.999);
  CHECK(planes[0].offset == Approx(-0.125).margin(0.01));
  CHECK(planes[0].share > 0.4);
  for (const scene::GroundPlane& plane : scene::ground_planes(points, both)) CHECK(std::abs(plane.normal.z) < 0.9);
  CHECK(scene::ground_planes(std::span(points).first(49), above).empty());
  const std::vector<glm::vec3> one_spot(100, glm::vec3(0.1f));
  CHECK(scene::ground_planes(one_spot, above).empty());
}

TEST_CASE("a model records the up direction unless it is the mean of its cameras", "[scene][up]") {
  scene::Scene scene;
  scene.train.push_back({"a.png", level({0, -1, 0}, 90, 0), {}});
  const auto options_of = [&] { return train::model_options(scene, train::Settings{}, {}); };
  CHECK_FALSE(options_of().up);
  CHECK(options_of().shown_up->z == Approx(1));
  scene.up = glm::dvec3(0, 1, 0);
  CHECK(options_of().up == glm::dvec3(0, 1, 0));
  scene.synthetic = true;
  CHECK(options_of().up == glm::dvec3(0, 0, 1));
}
