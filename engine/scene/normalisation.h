// Normalisation of a dataset to unit extent.
#pragma once

#include <optional>
#include <span>
#include <string>

#include "scene/camera.h"
#include "scene/point_cloud.h"

namespace trisoup::scene {

/// Similarity transform from the dataset's coordinates to normalised coordinates: normalised = scale * (world -
/// centre).
struct Normalisation {
  glm::dvec3 centre{0.0};
  double scale = 1.0;
  glm::dvec3 to_normalised(const glm::dvec3& world) const { return scale * (world - centre); }
  glm::dvec3 to_world(const glm::dvec3& normalised) const { return normalised / scale + centre; }
};

/// Returns the point nearest to the optical axes of all cameras in the least-squares sense, or nullopt if the axes are
/// so parallel that the result would depend on noise. `cameras` must not be empty.
std::optional<glm::dvec3> meeting_point(std::span<const Camera> cameras);

/// Returns the normalisation after which the mean distance of the cameras from the origin is 1.
/// The centre is the point nearest to all optical axes in the least-squares sense. If the axes are too parallel, the
/// centre lies ahead of the mean camera: at the median depth of the points in front of it, or without points at four
/// times the mean distance of the cameras from their mean. For a single camera, the centre lies at that median depth,
/// or without points at the camera's distance from the origin (1 if the camera is at the origin).
/// `cameras` must not be empty. Throws Error that begins with `name` if there are several cameras and all are at the
/// same position.
Normalisation find_normalisation(std::span<const Camera> cameras, const PointCloud& points, const std::string& name);

/// Returns the camera in normalised coordinates. Its image of the normalised scene is the same as before.
Camera normalised(const Camera& camera, const Normalisation& normalisation);

}  // namespace trisoup::scene
