// Moves the camera by mouse and keys.
#pragma once

#include <optional>

#include <glm/glm.hpp>

#include "flight.h"
#include "render/cameras.h"
#include "scene/camera.h"

namespace trisoup::viewer {

/// A turntable camera that orbits a target and keeps the horizon level. After snap() it is exactly the given camera
/// until it is moved. Normalised coordinates; angles in radians.
class Navigation {
 public:
  explicit Navigation(const render::Framing& home) { set_home(home); }

  void set_home(const render::Framing& home);
  const render::Framing& home() const { return home_; }
  void set_up(const glm::dvec3& up);
  void set_fov(double fov) { fov_ = fov; }
  double fov() const { return fov_; }

  void start_at(const scene::Camera& camera);         // snaps to the camera; reset() returns to it
  void reset();                                       // back to the start: that camera, else a place above the soup
  void frame();                                       // same direction, whole soup in view
  void orbit(double azimuth, double elevation);       // around the target
  void look(double azimuth, double elevation);        // turns around the eye
  void pan(double right, double up);                  // in image heights at the target's distance
  void zoom(double factor);                           // divides the distance to the target
  void fly(double right, double up, double forward);  // normalised units; moves the target too
  void snap(const scene::Camera& camera);
  bool snapped() const { return snapped_ && !free_; }

  /// Flies to a camera of the dataset. advance() must be called until it returns false.
  void fly_to(const scene::Camera& camera);
  /// Flies to where the point, at the same place of the eye, is in the middle, and orbits it from then on. Does nothing
  /// if the point is the eye or straight above or below it.
  void pivot(const glm::dvec3& point);
  bool flying() const { return flight_.has_value(); }
  /// Continues a flight by some seconds. Returns false if there is none, or none is left.
  bool advance(double seconds);
  /// From the eye to the point that the camera orbits.
  double distance() const { return snapped_ ? pivot_distance() : distance_; }

  scene::Camera camera(int width, int height) const;

 private:
  glm::dvec3 towards_eye() const;
  void release();  // ends a flight; turntable camera at the position of the snapped one
  double pivot_distance() const;
  void aim(const glm::dvec3& forward);

  render::Framing home_;
  glm::dvec3 target_{0.0}, up_{0, 1, 0}, x_{1, 0, 0}, y_{0, 0, 1};
  double azimuth_ = 0, elevation_ = 0, distance_ = 1, fov_ = 0.7;
  std::optional<scene::Camera> snapped_, start_;
  std::optional<double> pivot_;  // known distance from snapped_ to the point that it orbits
  bool free_ = false;            // snapped_ is not a view of the dataset
  std::optional<Flight> flight_;
};

}  // namespace trisoup::viewer
