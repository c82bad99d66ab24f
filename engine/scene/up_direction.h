// Which way is up in a scene: from how the cameras were held, and from the ground that the sparse points show.
#pragma once

#include <span>
#include <string>

#include <glm/glm.hpp>

#include "scene/camera.h"

namespace trisoup::scene {

struct UpDirection {
  glm::dvec3 direction{0.0, 1.0, 0.0};  // unit length
  /// What decided, for messages: "EXIF orientation", "level cameras" and the like. Empty: `direction` is the mean of
  /// the cameras' up directions, and nothing tells otherwise.
  std::string reason;
};

/// Returns the up direction of a scene in normalised coordinates (scene/normalisation.h), in which the cameras' axes
/// meet near the origin at mean distance 1.
/// orientations: EXIF orientation of each camera's photograph, 1 to 8; 1 if it is unknown or was applied to the pixels.
/// Empty: all are 1. points: sparse points; may be empty.
///
/// People hold cameras level: the horizontal axis of most cameras is perpendicular to the up direction, also where all
/// cameras look down and their mean up direction is tilted. Portrait photographs are level about their other axis.
/// Cameras that look straight down have no level axis; then up is against the viewing direction. The largest plane of
/// the points that has the cameras on one side counts as ground. It overrules cameras that are upside down only if
/// nearly all points lie on its side.
/// Returns the mean of the cameras' up directions if it agrees within 3 degrees, and +Y without cameras. The result
/// depends on the arguments only.
UpDirection up_direction(std::span<const Camera> cameras, std::span<const int> orientations,
                         std::span<const glm::vec3> points);

}  // namespace trisoup::scene
