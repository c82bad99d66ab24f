#include "navigation.h"

#include <algorithm>
#include <cmath>

namespace trisoup::viewer {
namespace {

constexpr double kSteepest = 1.55;  // the horizon is undefined when looking straight up or down
constexpr double kStartElevation = 0.35;

}  // namespace

void Navigation::set_home(const render::Framing& home) {
  home_ = home;
  start_.reset();
  set_up(home.up);
  reset();
}

void Navigation::set_up(const glm::dvec3& up) {
  release();
  const glm::dvec3 eye_direction = towards_eye();
  up_ = glm::normalize(up);
  const glm::dvec3 helper = std::abs(up_.x) < 0.9 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
  x_ = glm::normalize(glm::cross(helper, up_));
  y_ = glm::cross(up_, x_);
  aim(-eye_direction);
}

void Navigation::start_at(const scene::Camera& camera) {
  start_ = camera;
  snap(camera);
}

void Navigation::reset() {
  if (start_) return snap(*start_);
  flight_.reset();
  snapped_.reset();
  target_ = home_.target;
  distance_ = home_.distance;
  fov_ = home_.fov;
  azimuth_ = 0.6;
  elevation_ = kStartElevation;
}

void Navigation::frame() {
  release();
  target_ = home_.target;
  distance_ = home_.distance;
}

void Navigation::orbit(double azimuth, double elevation) {
  release();
  azimuth_ += azimuth;
  elevation_ = std::clamp(elevation_ + elevation, -kSteepest, kSteepest);
}

void Navigation::look(double azimuth, double elevation) {
  release();
  const glm::dvec3 eye = target_ + distance_ * towards_eye();
  azimuth_ += azimuth;
  elevation_ = std::clamp(elevation_ + elevation, -kSteepest, kSteepest);
  target_ = eye - distance_ * towards_eye();
}

void Navigation::pan(double right, double up) {
  const double height = 2 * distance_ * std::tan(0.5 * fov_);
  fly(right * height, up * height, 0);
}

void Navigation::zoom(double factor) {
  release();
  distance_ = std::clamp(distance_ / factor, 1e-4, 1e3);
}

void Navigation::fly(double right, double up, double forward) {
  release();
  const glm::dvec3 z = -towards_eye(), x = glm::normalize(glm::cross(z, up_)), y = glm::cross(x, z);
  target_ += right * x + up * y + forward * z;
}

void Navigation::snap(const scene::Camera& camera) {
  flight_.reset();
  pivot_.reset();
  free_ = false;
  snapped_ = camera;
  fov_ = 2 * std::atan(0.5 * camera.height / camera.fy);
}

void Navigation::fly_to(const scene::Camera& camera) {
  constexpr int kSide = 1000;  // of a turntable camera's image; it has no size of its own
  const Aimed from{snapped_.value_or(this->camera(kSide, kSide)), distance()};
  snap(camera);
  flight_ = Flight{from, {camera, distance()}, kFlightSeconds, 0, true};
  advance(0);
}

void Navigation::pivot(const glm::dvec3& point) {
  constexpr int kSide = 1000;
  const scene::Camera now = snapped_.value_or(camera(kSide, kSide));
  const glm::dvec3 ahead = point - now.centre();
  const double length = glm::length(ahead);
  if (!(length > 1e-6) || glm::length(glm::cross(ahead / length, up_)) < 0.02) return;
  const double fov = 2 * std::atan(0.5 * now.height / now.fy);
  const scene::Camera aimed = render::look_at(now.centre(), point, up_, fov, now.width, now.height);
  flight_ = Flight{{now, distance()}, {aimed, length}, kPivotSeconds, 0, false};
  advance(0);
}

bool Navigation::advance(double seconds) {
  if (!flight_) return false;
  flight_->time += seconds;
  const Aimed now = flight_->now();
  snapped_ = now.camera;
  fov_ = 2 * std::atan(0.5 * now.camera.height / now.camera.fy);
  const bool arrived = flight_->arrived();
  free_ = !(arrived && flight_->to_view);
  pivot_.reset();
  if (free_) pivot_ = now.distance;
  if (arrived) flight_.reset();
  return !arrived;
}

scene::Camera Navigation::camera(int width, int height) const {
  if (snapped_) return render::reshaped(*snapped_, width, height);
  return render::look_at(target_ + distance_ * towards_eye(), target_, up_, fov_, width, height);
}

glm::dvec3 Navigation::towards_eye() const {
  return std::cos(elevation_) * (std::cos(azimuth_) * x_ + std::sin(azimuth_) * y_) + std::sin(elevation_) * up_;
}

double Navigation::pivot_distance() const {
  // Unless it is known: the point on the viewing axis at the distance of the soup's centre.
  if (pivot_) return *pivot_;
  return std::max(0.05 * home_.distance, glm::dot(home_.target - snapped_->centre(), snapped_->forward()));
}

void Navigation::release() {
  flight_.reset();
  if (!snapped_) return;
  const glm::dvec3 eye = snapped_->centre(), forward = snapped_->forward();
  distance_ = pivot_distance();
  aim(forward);
  target_ = eye - distance_ * towards_eye();
  snapped_.reset();
  pivot_.reset();
  free_ = false;
}

void Navigation::aim(const glm::dvec3& forward) {
  const glm::dvec3 d = -glm::normalize(forward);
  elevation_ = std::clamp(std::asin(std::clamp(glm::dot(d, up_), -1.0, 1.0)), -kSteepest, kSteepest);
  azimuth_ = std::atan2(glm::dot(d, y_), glm::dot(d, x_));
}

}  // namespace trisoup::viewer
