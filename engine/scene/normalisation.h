// Brings a dataset to unit extent.
#pragma once

#include <span>
#include <string>

#include "scene/camera.h"
#include "scene/point_cloud.h"

namespace trisoup::scene {

/// normalised = scale * (world - centre); the similarity that brings the dataset to unit extent.
struct Normalisation {
  glm::dvec3 centre{0.0};
  double scale = 1.0;
  glm::dvec3 to_normalised(const glm::dvec3& world) const { return scale * (world - centre); }
  glm::dvec3 to_world(const glm::dvec3& normalised) const { return normalised / scale + centre; }
};

/// The normalisation after which the cameras lie at mean distance 1 from the origin. The centre is the point nearest to
/// all optical axes in the least-squares sense. Where axes are too parallel to meet, it lies ahead of the mean camera:
/// at the median depth of the points in front of it, or without points at four times the cameras' mean distance from
/// their mean. A single camera has its centre at that median depth, or without points at its own distance from the
/// origin (1 if it stands there). Throws Error, naming `name`, for several cameras all at one spot. `cameras` must not
/// be empty.
Normalisation find_normalisation(std::span<const Camera> cameras, const PointCloud& points, const std::string& name);

/// The camera in normalised coordinates: its picture of the normalised scene is the one it had of the scene.
Camera normalised(const Camera& camera, const Normalisation& normalisation);

}  // namespace trisoup::scene
