// How well two views tell a depth.
#pragma once

#include "scene/camera.h"

namespace trisoup::scene {

/// Distance in pixels between the images of `place` in `camera` and of what lies infinitely far behind it, as seen from
/// `eye`. 0 if one of the two is not in front of the camera. World space.
double parallax(const Camera& camera, const glm::dvec3& eye, const glm::dvec3& place);

}  // namespace trisoup::scene
