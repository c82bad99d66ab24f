// Cameras that nobody photographed with: looking at a point, turning around it, spread over a hemisphere.
#pragma once

#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "render/gpu_model.h"
#include "render/renderer.h"
#include "scene/camera.h"
#include "scene/normalisation.h"

namespace trisoup::render {

/// Square pixels, principal point in the middle. fov: vertical, radians. `up` may be at any angle to the view but along
/// it.
scene::Camera look_at(const glm::dvec3& eye, const glm::dvec3& target, const glm::dvec3& up, double fov, int width,
                      int height);

/// The camera for a picture of another shape: its vertical field of view stays, and so does what lies in the middle.
scene::Camera reshaped(const scene::Camera& camera, int width, int height);

/// Mean of the cameras' up directions, unit; +Y where they cancel out or there are none.
glm::dvec3 mean_up(std::span<const scene::Camera> cameras);

/// Where a soup is and how far away it fits the picture. Normalised coordinates.
struct Framing {
  glm::dvec3 target{0.0}, up{0.0, 1.0, 0.0};
  double distance = 1.0;
  double fov = 0.7;  // vertical, radians
};

/// From the middle of the model's vertices (5 to 95 % along each axis, since soups have strays), and the cameras' own
/// distance and field of view where there are any.
Framing frame(std::span<const glm::vec3> vertices, std::span<const scene::Camera> cameras, const glm::dvec3& up);

/// `count` cameras on a circle around the target, `elevation` radians above it, starting at angle `start`.
std::vector<scene::Camera> orbit(const Framing& framing, int count, double elevation, double start, int width,
                                 int height);

/// `count` cameras on the upper hemisphere around the target at the points of the Fibonacci lattice (Gonzalez, 2010).
std::vector<scene::Camera> hemisphere(const Framing& framing, int count, int width, int height);

/// A camera of normalised coordinates as the renderer takes it. near, far: normalised.
View view_of(const scene::Camera& camera, double near, double far);

/// The same for a camera normalised for another dataset than the model's.
View view_of(const scene::Camera& camera, const scene::Normalisation& of_camera, const GpuModel& model, double near,
             double far);

}  // namespace trisoup::render
