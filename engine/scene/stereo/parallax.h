// How well views tell depths.
#pragma once

#include <span>

#include "scene/camera.h"
#include "scene/stereo/depth_maps.h"

namespace trisoup::scene {

/// Distance in pixels between the images of `place` in `camera` and of what lies infinitely far behind it, as seen from
/// `eye`. 0 if one of the two is not in front of the camera. World space.
double parallax(const Camera& camera, const glm::dvec3& eye, const glm::dvec3& place);

/// Where the cameras of depth maps are: the mean of their positions, and the largest distance from it. Views without a
/// map do not count.
struct CameraCloud {
  glm::dvec3 centre{0.0};
  double radius = 0;
};
CameraCloud camera_cloud(std::span<const DepthMap> maps);

}  // namespace trisoup::scene
