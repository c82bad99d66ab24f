// How mouse and keys move the camera.
#pragma once

#include <optional>

#include <glm/glm.hpp>

#include "render/cameras.h"
#include "scene/camera.h"

namespace trisoup::viewer {

/// A camera on a turntable: it orbits a target, level with the ground. Or, after snap(), exactly a given camera, until
/// it is moved. Normalised coordinates, radians.
class Navigation {
 public:
  explicit Navigation(const render::Framing& home) { set_home(home); }

  void set_home(const render::Framing& home);
  const render::Framing& home() const { return home_; }
  void set_up(const glm::dvec3& up);
  void set_fov(double fov) { fov_ = fov; }
  double fov() const { return fov_; }

  void reset();                                       // to where it began
  void frame();                                       // the same direction, the whole soup in the picture
  void orbit(double azimuth, double elevation);       // around the target
  void look(double azimuth, double elevation);        // turns the head
  void pan(double right, double up);                  // in heights of the picture at the target's distance
  void zoom(double factor);                           // distance to the target is divided by it
  void fly(double right, double up, double forward);  // in normalised units; the target comes along
  void snap(const scene::Camera& camera);
  bool snapped() const { return snapped_.has_value(); }

  scene::Camera camera(int width, int height) const;

 private:
  glm::dvec3 towards_eye() const;
  void release();  // leaves a snapped camera where it stands
  void aim(const glm::dvec3& forward);

  render::Framing home_;
  glm::dvec3 target_{0.0}, up_{0, 1, 0}, x_{1, 0, 0}, y_{0, 0, 1};
  double azimuth_ = 0, elevation_ = 0, distance_ = 1, fov_ = 0.7;
  std::optional<scene::Camera> snapped_;
};

}  // namespace trisoup::viewer
