// Tests engine/scene/load/consistency.cpp and pose_check.cpp.
#include <catch2/catch.hpp>

#include <cmath>

#include <glm/gtc/matrix_transform.hpp>

#include "scene/load/consistency.h"
#include "scene/load/pose_check.h"

using namespace trisoup::scene;
using trisoup::Image;

namespace {

/// A ring of cameras that look at the origin from a distance of 4 and a height of 1.5.
std::vector<scene::Camera> ring(int count) {
  std::vector<scene::Camera> cameras;
  for (int i = 0; i < count; ++i) {
    const double a = 6.2831853 * i / count;
    const glm::dmat4 opengl =
        glm::lookAt(glm::dvec3(4 * std::cos(a), 4 * std::sin(a), 1.5), glm::dvec3(0.0), glm::dvec3(0, 0, 1));
    const glm::dmat4 axes(1, 0, 0, 0, 0, -1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1);
    cameras.push_back({120, 90, 105, 105, 60, 45, axes * opengl});
  }
  return cameras;
}

glm::u8vec3 colour_at(const glm::dvec3& p) {
  const auto wave = [](double v) { return static_cast<std::uint8_t>(127.5 + 127 * std::sin(8 * v)); };
  return {wave(p.x), wave(p.y), wave(p.z + p.x)};
}

/// Points on the plane z = 0 in the colours of that plane.
PointCloud plane() {
  PointCloud cloud;
  for (int i = 0; i < 40; ++i)
    for (int j = 0; j < 40; ++j) {
      const glm::dvec3 p(-1 + i / 20.0, -1 + j / 20.0, 0);
      cloud.positions.push_back(p);
      cloud.colours.push_back(colour_at(p));
    }
  return cloud;
}

/// What the cameras see of the plane z = 0.
std::vector<Probe> photographs(const std::vector<scene::Camera>& cameras) {
  std::vector<Probe> probes;
  for (std::size_t v = 0; v < cameras.size(); ++v) {
    const scene::Camera& c = cameras[v];
    const glm::dmat4 to_world = glm::inverse(c.world_to_camera);
    Image image{c.width, c.height, {}};
    for (int y = 0; y < c.height; ++y)
      for (int x = 0; x < c.width; ++x) {
        const glm::dvec3 ray(to_world * glm::dvec4((x + 0.5 - c.cx) / c.fx, (y + 0.5 - c.cy) / c.fy, 1, 0));
        const glm::u8vec3 colour = colour_at(c.centre() - ray * (c.centre().z / ray.z));
        image.rgba.insert(image.rgba.end(), {colour.r, colour.g, colour.b, 255});
      }
    probes.push_back({v, std::move(image)});
  }
  return probes;
}

/// What a reader makes of a file that holds the pose `m` (world to camera, OpenCV axes) in the convention `wrong`.
glm::dmat4 as_read(const glm::dmat4& m, PoseReading wrong, bool opengl) {
  const glm::dmat4 axes(1, 0, 0, 0, 0, -1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1), inverse = glm::inverse(m);
  if (opengl) {  // the reader inverts the matrix and turns the axes
    if (wrong == PoseReading::other_axes) return axes * glm::inverse(inverse);
    if (wrong == PoseReading::inverse) return axes * glm::inverse(axes * m);
    return axes * inverse;
  }
  if (wrong == PoseReading::other_axes) return axes * m;
  return wrong == PoseReading::inverse ? inverse : inverse * axes;
}

}  // namespace

TEST_CASE("points fit the cameras that saw them, and not when they are turned, scaled or shifted", "[scene][poses]") {
  const std::vector<scene::Camera> cameras = ring(12);
  const std::vector<Probe> probes = photographs(cameras);
  const PointFit right = fit_of_points(cameras, plane(), probes);
  CHECK(right.inside > 0.95);
  REQUIRE(right.colour);
  CHECK(*right.colour < 0.3);
  CHECK(right.is_certain());

  PointCloud turned = plane(), scaled = plane(), shifted = plane();
  for (glm::dvec3& p : turned.positions) p = {-p.x, p.z, p.y};
  for (glm::dvec3& p : scaled.positions) p *= 10;
  for (glm::dvec3& p : shifted.positions) p.x += 20;
  CHECK_FALSE(fit_of_points(cameras, turned, probes).holds());
  CHECK_FALSE(fit_of_points(cameras, scaled, probes).holds());
  CHECK_FALSE(fit_of_points(cameras, shifted, probes).holds());
  // Grey points say nothing about colours; where they project still counts.
  PointCloud grey = plane();
  grey.colours.assign(grey.positions.size(), glm::u8vec3(128));
  CHECK_FALSE(fit_of_points(cameras, grey, probes).colour);
  CHECK(fit_of_points(cameras, grey, probes).holds());
}

TEST_CASE("poses of another convention are recognised by points, and without points by the photographs",
          "[scene][poses]") {
  const std::vector<scene::Camera> cameras = ring(24);
  const std::vector<Probe> probes = photographs(cameras);
  const TakeProbes take = [&](std::size_t, int) { return probes; };
  for (const bool opengl : {true, false})
    for (const PoseReading wrong : {PoseReading::other_axes, PoseReading::inverse, PoseReading::inverse_other_axes}) {
#ifdef TRISOUP_SANITIZED
      if (!opengl || wrong != PoseReading::inverse_other_axes) continue;  // all run the same code, for 10 s each
#endif
      CAPTURE(opengl, to_string(wrong, opengl));
      std::vector<scene::Camera> written = cameras;
      for (scene::Camera& camera : written) camera.world_to_camera = as_read(camera.world_to_camera, wrong, opengl);
      for (const PointCloud& points : {plane(), PointCloud{}}) {
        const PoseCheck check = check_poses(
            written, points, opengl ? PoseConvention::opengl_to_world : PoseConvention::world_to_opencv, "file", take);
        CHECK(check.reading == wrong);
        CHECK(check.points_fit);
        CHECK(check.warning.find(to_string(wrong, opengl)) != std::string::npos);
      }
    }
  CHECK(check_poses(cameras, plane(), PoseConvention::opengl_to_world, "file", take).warning.empty());
#ifndef TRISOUP_SANITIZED
  CHECK(check_poses(cameras, {}, PoseConvention::opengl_to_world, "file", take).warning.empty());
#endif
}

TEST_CASE("points of another frame are not used, and the poses stay", "[scene][poses][same_code]") {
  const std::vector<scene::Camera> cameras = ring(24);
  const std::vector<Probe> probes = photographs(cameras);
  PointCloud turned = plane();
  for (glm::dvec3& p : turned.positions) p = {-p.x, p.z, p.y};
  const PoseCheck check =
      check_poses(cameras, turned, PoseConvention::opengl_to_world, "file", [&](std::size_t, int) { return probes; });
  CHECK(check.reading == PoseReading::as_written);
  CHECK_FALSE(check.points_fit);
  CHECK(check.warning.find("the sparse points do not fit the cameras") != std::string::npos);
}

TEST_CASE("cameras far from all others are found", "[scene][poses]") {
  std::vector<scene::Camera> cameras = ring(16);
  CHECK(far_cameras(cameras, {}).empty());
  CHECK(look_inwards(cameras, 0.1));
  cameras[3].world_to_camera[3] *= 30.0;
  CHECK(far_cameras(cameras, {}) == std::vector<std::size_t>{3});
  // Thirteen photographs from one tripod and three of a walk through the scene.
  std::vector<scene::Camera> tripod = ring(16);
  for (int i = 0; i < 13; ++i) tripod[std::size_t(i)] = tripod[0];
  CHECK(far_cameras(tripod, plane()).empty());
  cameras.resize(4);
  CHECK(far_cameras(cameras, {}).empty());
}
