// Tests shaders/common/camera_motion.h against finite differences in double, scene/pose_change.h and
// base/small_system.h.
#include <catch2/catch.hpp>

#include <array>
#include <cmath>
#include <functional>
#include <vector>

#include "base/small_system.h"
#include "common/host.h"
#include "scene/camera.h"
#include "scene/pose_change.h"
#include "soup/random.h"

using namespace trisoup;

namespace {

glm::dvec3 random_point(soup::Random& r, double size) {
  return {r.uniform(-size, size), r.uniform(-size, size), r.uniform(-size, size)};
}

scene::Camera camera_towards_origin(const glm::dvec3& centre) {
  scene::Camera camera;
  camera.width = 60, camera.height = 40;
  camera.fx = 55, camera.fy = 50, camera.cx = 31, camera.cy = 19;
  const glm::dvec3 z = -glm::normalize(centre), x = glm::normalize(glm::cross(glm::dvec3(0, 0, -1), z)),
                   y = glm::cross(z, x);
  camera.world_to_camera =
      glm::inverse(glm::dmat4(glm::dvec4(x, 0), glm::dvec4(y, 0), glm::dvec4(z, 0), glm::dvec4(centre, 1)));
  return camera;
}

/// Ring of cameras around the origin.
std::vector<scene::Camera> ring_of_cameras(int count) {
  std::vector<scene::Camera> cameras;
  for (int i = 0; i < count; ++i) {
    const double a = 6.2831853 * i / count;
    cameras.push_back(camera_towards_origin({std::cos(a), std::sin(a), 0.3 + 0.1 * (i % 3)}));
  }
  return cameras;
}

f64::PixelMotion motion_at(const scene::Camera& camera, const glm::dvec3& point) {
  const glm::dmat4 m = scene::clip_from_world(camera, 0.1, 10);
  const glm::dvec4 clip = m * glm::dvec4(point, 1);
  const auto row = [&](int r) { return glm::dvec3(m[0][r], m[1][r], m[2][r]); };
  return f64::pixel_motion(point, row(0), row(1), row(3), glm::dvec2(clip) / clip.w, clip.w,
                           {0.5 * camera.width, 0.5 * camera.height});
}

}  // namespace

TEST_CASE("the motion of a pixel is the derivative of its place by the camera's pose", "[poses]") {
  soup::Random r(3);
  for (int i = 0; i < 50; ++i) {
    const scene::Camera camera = camera_towards_origin(glm::normalize(random_point(r, 1) + glm::dvec3(2, 0, 0)));
    const glm::dvec3 point = random_point(r, 0.2);
    REQUIRE(scene::shown_at(camera, point));
    const f64::PixelMotion m = motion_at(camera, point);
    for (int axis = 0; axis < 3; ++axis) {
      const auto pixel = [&](double turn, double shift) {
        glm::dvec3 along(0.0);
        along[axis] = 1;
        // A turn about the world's origin moves the camera's centre, too.
        scene::PoseChange change{turn * along, shift * along};
        const glm::dvec3 c = camera.centre();
        const scene::Camera turned = scene::changed(scene::Camera(), {-change.turn, {}});
        change.shift += glm::dmat3(turned.world_to_camera) * c - c;
        return scene::shown_at(scene::changed(camera, change), point)->pixel;
      };
      constexpr double h = 1e-5;
      const glm::dvec2 by_turn = (pixel(h, 0) - pixel(-h, 0)) / (2 * h),
                       by_shift = (pixel(0, h) - pixel(0, -h)) / (2 * h);
      CHECK(-m.x_turn[axis] == Approx(by_turn.x).epsilon(1e-6).margin(1e-6));
      CHECK(-m.y_turn[axis] == Approx(by_turn.y).epsilon(1e-6).margin(1e-6));
      CHECK(-m.x_shift[axis] == Approx(by_shift.x).epsilon(1e-6).margin(1e-6));
      CHECK(-m.y_shift[axis] == Approx(by_shift.y).epsilon(1e-6).margin(1e-6));
    }
  }
}

TEST_CASE("the sums of a pixel are those of its normal equations", "[poses]") {
  soup::Random r(4);
  const scene::Camera camera = camera_towards_origin({0.9, 0.3, 0.4});
  const f64::PixelMotion m = motion_at(camera, {0.1, -0.05, 0.07});
  const glm::dvec3 error = random_point(r, 0.2), right = random_point(r, 0.1), down = random_point(r, 0.1);
  glm::dvec4 sums[MOTION_SUMS]{};
  f64::add_to_motion(m, error, right, down, 4.0, sums);
  const double x[6] = {m.x_turn.x, m.x_turn.y, m.x_turn.z, m.x_shift.x, m.x_shift.y, m.x_shift.z},
               y[6] = {m.y_turn.x, m.y_turn.y, m.y_turn.z, m.y_shift.x, m.y_shift.y, m.y_shift.z};
  const double weight = sums[7].x;
  CHECK(weight == Approx(0.05 / (0.05 + (std::abs(error.x) + std::abs(error.y) + std::abs(error.z)) / 3)));
  const auto jacobian = [&](int c, int k) { return right[c] * x[k] + down[c] * y[k]; };
  const auto sum = [&](const std::function<double(int)>& f) { return weight * (f(0) + f(1) + f(2)); };
  const auto at = [&](int i) { return sums[i / 4][i % 4]; };
  constexpr int kPlaces[6][6] = {{0, 1, 2, 8, 9, 10},     {1, 4, 5, 12, 13, 14},   {2, 5, 6, 16, 17, 18},
                                 {8, 12, 16, 20, 21, 22}, {9, 13, 17, 21, 24, 25}, {10, 14, 18, 22, 25, 26}};
  constexpr int kGradient[6] = {3, 7, 11, 15, 19, 23};
  for (int i = 0; i < 6; ++i) {
    CHECK(at(kGradient[i]) == Approx(sum([&](int c) { return jacobian(c, i) * error[c]; })));
    for (int j = 0; j < 6; ++j)
      CHECK(at(kPlaces[i][j]) == Approx(sum([&](int c) { return jacobian(c, i) * jacobian(c, j); })));
  }
  CHECK(at(27) == Approx(weight * (glm::dot(right, right) + glm::dot(down, down)) / 4));
  CHECK(at(29) == Approx(weight * glm::dot(error, error)));
}

TEST_CASE("a change of pose turns a camera about its centre and moves it", "[poses]") {
  const scene::Camera camera = camera_towards_origin({0.9, 0.3, 0.4});
  CHECK(scene::changed(camera, {}).world_to_camera == camera.world_to_camera);
  const scene::Camera moved = scene::changed(camera, {{0, 0, 0.1}, {0.2, 0, 0}});
  CHECK(glm::distance(moved.centre(), camera.centre() + glm::dvec3(0.2, 0, 0)) < 1e-12);
  const glm::dvec3 f = camera.forward();
  const glm::dvec3 expected(std::cos(0.1) * f.x - std::sin(0.1) * f.y, std::sin(0.1) * f.x + std::cos(0.1) * f.y, f.z);
  CHECK(glm::distance(moved.forward(), expected) < 1e-12);
  CHECK(moved.fx == camera.fx);
}

TEST_CASE("a motion of the whole scene is no correction of its cameras", "[poses]") {
  const std::vector<scene::Camera> cameras = ring_of_cameras(9);
  const glm::dvec3 turn(0.01, -0.02, 0.005), shift(0.03, 0, -0.01);
  std::vector<scene::PoseChange> common, single(cameras.size());
  for (const scene::Camera& c : cameras)
    common.push_back({turn, glm::cross(turn, c.centre()) + shift + 0.02 * c.centre()});
  for (const scene::PoseChange& c : scene::without_common(cameras, common)) {
    CHECK(glm::length(c.turn) < 1e-8);
    CHECK(glm::length(c.shift) < 1e-8);
  }
  // The change of one camera of many is hardly common.
  single[3] = {{0.01, 0, 0}, {0, 0.01, 0}};
  const auto rest = scene::without_common(cameras, single);
  CHECK(rest[3].turn.x > 0.006);
  CHECK(rest[3].shift.y > 0.006);
  CHECK(glm::length(rest[0].turn) < 0.004);
  const auto again = scene::without_common(cameras, rest);
  for (std::size_t i = 0; i < rest.size(); ++i) CHECK(glm::distance(again[i].shift, rest[i].shift) < 1e-8);
  // All motion of a single camera is that of the scene.
  const auto alone = scene::without_common(std::span(cameras).first(1), std::span(single).subspan(3, 1));
  CHECK(glm::length(alone[0].turn) + glm::length(alone[0].shift) < 1e-6);
}

TEST_CASE("small systems are solved, unknowns without a pivot are 0", "[poses]") {
  const SquareMatrix<3> matrix{{{4, 1, 0.5}, {1, 3, -1}, {0.5, -1, 2}}};
  const std::array<double, 3> x{1, -2, 0.25};
  std::array<double, 3> right{};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) right[i] += matrix[i][j] * x[j];
  const auto found = solve_symmetric<3>(matrix, right);
  for (std::size_t i = 0; i < 3; ++i) CHECK(found[i] == Approx(x[i]));
  const auto part = solve_symmetric<2>({{{4, 0}, {0, 0}}}, {8, 5});
  CHECK(part[0] == Approx(2));
  CHECK(part[1] == 0);
}
