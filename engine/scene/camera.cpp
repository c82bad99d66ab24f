#include "scene/camera.h"

namespace trisoup::scene {

glm::dvec3 Camera::centre() const {
  const glm::dmat3 rotation(world_to_camera);
  return -(glm::transpose(rotation) * glm::dvec3(world_to_camera[3]));
}

glm::dvec3 Camera::forward() const {
  // The third row of the rotation; glm indexes by column first.
  return {world_to_camera[0][2], world_to_camera[1][2], world_to_camera[2][2]};
}

std::optional<Shown> shown_at(const Camera& camera, const glm::dvec3& point) {
  const glm::dvec3 c(camera.world_to_camera * glm::dvec4(point, 1.0));
  if (!(c.z > 0)) return std::nullopt;
  const glm::dvec2 pixel(camera.fx * c.x / c.z + camera.cx, camera.fy * c.y / c.z + camera.cy);
  if (!(pixel.x >= 0 && pixel.y >= 0 && pixel.x < camera.width && pixel.y < camera.height)) return std::nullopt;
  return Shown{pixel, c.z};
}

Camera resized(const Camera& camera, int width, int height) {
  const double x = double(width) / camera.width, y = double(height) / camera.height;
  Camera result = camera;
  result.width = width, result.height = height;
  result.fx *= x, result.cx *= x;
  result.fy *= y, result.cy *= y;
  return result;
}

glm::dmat4 clip_from_world(const Camera& camera, double near, double far) {
  glm::dmat4 clip_from_camera(0.0);  // [column][row]
  clip_from_camera[0][0] = 2 * camera.fx / camera.width;
  clip_from_camera[1][1] = 2 * camera.fy / camera.height;
  clip_from_camera[2][0] = 2 * camera.cx / camera.width - 1;
  clip_from_camera[2][1] = 2 * camera.cy / camera.height - 1;
  clip_from_camera[2][2] = (far + near) / (far - near);
  clip_from_camera[2][3] = 1;
  clip_from_camera[3][2] = -2 * far * near / (far - near);
  return clip_from_camera * camera.world_to_camera;
}

PixelRays pixel_rays(const glm::dmat4& world_from_clip) {
  const glm::dvec4 x = world_from_clip[0], y = world_from_clip[1];
  const glm::dvec4 near = world_from_clip[3] - world_from_clip[2], far = world_from_clip[3] + world_from_clip[2];
  const double slope = 1.0 / near.w - 1.0 / far.w;
  return {glm::dvec3(near) / near.w - glm::dvec3(far) / far.w, glm::dvec3(x) * slope, glm::dvec3(y) * slope};
}

glm::dvec3 eye(const glm::dmat4& world_from_clip) {
  // The clip coordinates x, y and w of the eye are zero.
  return glm::dvec3(world_from_clip[2]) / world_from_clip[2].w;
}

}  // namespace trisoup::scene
