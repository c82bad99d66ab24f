#include "flight.h"

#include <cmath>

#include <glm/gtc/quaternion.hpp>

#include "render/cameras.h"

namespace trisoup::viewer {

Aimed between(const Aimed& a, const Aimed& b, double share) {
  if (share >= 1) return b;
  const scene::Camera from = render::reshaped(a.camera, b.camera.width, b.camera.height);
  Aimed result = b;
  scene::Camera& c = result.camera;
  c.fx = glm::mix(from.fx, c.fx, share);
  c.fy = glm::mix(from.fy, c.fy, share);
  c.cx = glm::mix(from.cx, c.cx, share);
  c.cy = glm::mix(from.cy, c.cy, share);
  result.distance = a.distance * std::pow(b.distance / a.distance, share);
  const glm::dvec3 target =
      glm::mix(from.centre() + a.distance * from.forward(), b.camera.centre() + b.distance * b.camera.forward(), share);
  const glm::dmat3 rotation = glm::mat3_cast(glm::slerp(glm::quat_cast(glm::dmat3(from.world_to_camera)),
                                                        glm::quat_cast(glm::dmat3(b.camera.world_to_camera)), share));
  c.world_to_camera = glm::dmat4(rotation);
  const glm::dvec3 eye = target - result.distance * c.forward();
  c.world_to_camera[3] = glm::dvec4(-(rotation * eye), 1.0);
  return result;
}

}  // namespace trisoup::viewer
