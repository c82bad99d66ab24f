#include "scene/stereo/parallax.h"

namespace trisoup::scene {

double parallax(const Camera& camera, const glm::dvec3& eye, const glm::dvec3& place) {
  const glm::dmat3 rotation(camera.world_to_camera);
  const glm::dvec3 near(camera.world_to_camera * glm::dvec4(place, 1.0)), far = rotation * (place - eye);
  if (!(near.z > 0 && far.z > 0)) return 0;
  return glm::length(glm::dvec2(camera.fx, camera.fy) * (glm::dvec2(near) / near.z - glm::dvec2(far) / far.z));
}

}  // namespace trisoup::scene
