// Conversion of cameras.
#include <cmath>
#include <numbers>

#include "api/impl.h"
#include "base/error.h"
#include "render/cameras.h"
#include "train/step/forward_pass.h"

namespace trisoup {

Camera public_camera(const scene::Camera& c, const scene::Normalisation& normalisation) {
  Camera camera{c.width, c.height, c.fx, c.fy, c.cx, c.cy, {}};
  const glm::dmat3 rotation(c.world_to_camera);
  // normalised = scale * (world - centre). The camera's axes are not scaled, so only the translation changes.
  const glm::dvec3 translation =
      glm::dvec3(c.world_to_camera[3]) / normalisation.scale - rotation * normalisation.centre;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column)
      camera.world_to_camera[static_cast<std::size_t>(4 * row + column)] = rotation[column][row];
    camera.world_to_camera[static_cast<std::size_t>(4 * row + 3)] = translation[row];
  }
  camera.world_to_camera[15] = 1;
  return camera;
}

scene::Camera unchecked_camera(const Camera& camera) {
  scene::Camera c{camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy};
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column)
      c.world_to_camera[column][row] = camera.world_to_camera[static_cast<std::size_t>(4 * row + column)];
  return c;
}

scene::Camera scene_camera(const Camera& camera) {
  const scene::Camera c = unchecked_camera(camera);
  constexpr double kMost = 1e9;
  if (c.width < 1 || c.height < 1 || std::uint64_t(c.width) * std::uint64_t(c.height) > train::kPassPixels * 64 ||
      !(c.fx > 0 && c.fx < kMost) || !(c.fy > 0 && c.fy < kMost))
    throw Error("camera: {} x {} pixels, focal lengths {} and {}; use positive values and at most 64 megapixels",
                c.width, c.height, c.fx, c.fy);
  if (!(std::abs(c.cx) < kMost && std::abs(c.cy) < kMost))
    throw Error("camera: its principal point is ({}, {}); use pixels", c.cx, c.cy);
  const glm::dmat3 rotation(c.world_to_camera);
  const glm::dmat3 square = glm::transpose(rotation) * rotation;
  bool rigid = glm::determinant(rotation) > 0;
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) rigid = rigid && std::abs(square[i][k] - (i == k ? 1 : 0)) < 1e-3;
    rigid = rigid && std::isfinite(c.world_to_camera[3][i]) && c.world_to_camera[i][3] == 0;
  }
  if (!rigid || c.world_to_camera[3][3] != 1)
    throw Error("camera: its world_to_camera is not a rotation and a translation; give a rigid 4 x 4 matrix");
  return c;
}

namespace {

void check_size(int width, int height) {
  if (width < 1 || height < 1) throw Error("camera: {} x {} pixels; use positive values", width, height);
}

}  // namespace

Camera look_at(const std::array<double, 3>& eye, const std::array<double, 3>& target, const std::array<double, 3>& up,
               double fov, int width, int height) {
  check_size(width, height);
  if (!(fov > 0 && fov < 180))
    throw Error("camera: its field of view is {} degrees; use more than 0, less than 180", fov);
  const auto point = [](const std::array<double, 3>& p) { return glm::dvec3(p[0], p[1], p[2]); };
  const glm::dvec3 ahead = point(target) - point(eye);
  if (!(glm::length(glm::cross(ahead, point(up))) > 1e-9 * glm::length(ahead) * glm::length(point(up))))
    throw Error("camera: it looks along `up` or nowhere; choose another up direction or target");
  return public_camera(
      render::look_at(point(eye), point(target), point(up), fov * std::numbers::pi / 180, width, height), {});
}

Camera resized(const Camera& camera, int width, int height) {
  check_size(width, height);
  return public_camera(scene::resized(scene_camera(camera), width, height), {});
}

}  // namespace trisoup
