#include "scene/stereo/parallax.h"

#include <algorithm>

namespace trisoup::scene {

double parallax(const Camera& camera, const glm::dvec3& eye, const glm::dvec3& place) {
  const glm::dmat3 rotation(camera.world_to_camera);
  const glm::dvec3 near(camera.world_to_camera * glm::dvec4(place, 1.0)), far = rotation * (place - eye);
  if (!(near.z > 0 && far.z > 0)) return 0;
  return glm::length(glm::dvec2(camera.fx, camera.fy) * (glm::dvec2(near) / near.z - glm::dvec2(far) / far.z));
}

CameraCloud camera_cloud(std::span<const DepthMap> maps) {
  CameraCloud cloud;
  double count = 0;
  for (const DepthMap& map : maps)
    if (!map.planes.empty()) cloud.centre += map.camera.centre(), ++count;
  if (count > 0) cloud.centre /= count;
  for (const DepthMap& map : maps)
    if (!map.planes.empty()) cloud.radius = std::max(cloud.radius, glm::distance(map.camera.centre(), cloud.centre));
  return cloud;
}

}  // namespace trisoup::scene
