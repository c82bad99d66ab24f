// Virtual cameras: looking at a point, on an orbit, distributed over a hemisphere, or between others.
#pragma once

#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "render/gpu_model.h"
#include "render/renderer.h"
#include "scene/camera.h"
#include "scene/normalisation.h"

namespace trisoup::render {

/// Camera with square pixels and centred principal point. fov: vertical, radians. `up` must not be parallel to the
/// viewing direction.
scene::Camera look_at(const glm::dvec3& eye, const glm::dvec3& target, const glm::dvec3& up, double fov, int width,
                      int height);

/// Adapts a camera to another image size. The vertical field of view and the centre of the image stay the same.
scene::Camera reshaped(const scene::Camera& camera, int width, int height);

/// Returns the mean of the cameras' up directions, unit length; +Y if they cancel out or there are no cameras.
glm::dvec3 mean_up(std::span<const scene::Camera> cameras);

/// Position of a soup and the distance from which it fits the picture. Normalised coordinates.
struct Framing {
  glm::dvec3 target{0.0}, up{0.0, 1.0, 0.0};
  double distance = 1.0;
  double fov = 0.7;  // vertical, radians
};

/// Frames the model: the centre of the vertices' bounding box (5 to 95 % along each axis, since soups have strays). If
/// there are cameras, uses the origin and their mean distance and field of view instead.
Framing frame(std::span<const glm::vec3> vertices, std::span<const scene::Camera> cameras, const glm::dvec3& up);

/// Returns `count` cameras on a circle around the target at `elevation` (radians). The first is at angle `start`.
std::vector<scene::Camera> orbit(const Framing& framing, int count, double elevation, double start, int width,
                                 int height);

/// Returns `count` cameras on the upper hemisphere around the target, at the points of a Fibonacci lattice (Gonzalez,
/// 2010).
std::vector<scene::Camera> hemisphere(const Framing& framing, int count, int width, int height);

/// Returns `count` cameras, in the middles of as many equal parts of the path that leads straight from each of
/// `stations` to the next one, all parts between two stations being equally long. They have the size of the first
/// station. stations: not empty.
std::vector<scene::Camera> along(std::span<const scene::Camera> stations, int count);

/// Converts a camera in normalised coordinates to the renderer's View. near, far: normalised units.
View view_of(const scene::Camera& camera, double near, double far);

/// The same for a camera that was normalised for a dataset other than the model's.
View view_of(const scene::Camera& camera, const scene::Normalisation& of_camera, const GpuModel& model, double near,
             double far);

}  // namespace trisoup::render
