#include "render/cameras.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <glm/gtc/quaternion.hpp>

#include "mesh/inner_box.h"

namespace trisoup::render {
namespace {

/// Returns two unit vectors that complete the unit vector `up` to a right-handed basis.
std::array<glm::dvec3, 2> ground(const glm::dvec3& up) {
  const glm::dvec3 helper = std::abs(up.x) < 0.9 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
  const glm::dvec3 x = glm::normalize(glm::cross(helper, up));
  return {x, glm::cross(up, x)};
}

scene::Camera around(const Framing& framing, double azimuth, double elevation, int width, int height) {
  const auto [x, y] = ground(framing.up);
  const glm::dvec3 towards =
      std::cos(elevation) * (std::cos(azimuth) * x + std::sin(azimuth) * y) + std::sin(elevation) * framing.up;
  // When looking straight down, `up` is along the view, so a ground axis replaces it.
  const glm::dvec3 up = std::abs(std::sin(elevation)) > 0.9999 ? y : framing.up;
  return look_at(framing.target + framing.distance * towards, framing.target, up, framing.fov, width, height);
}

/// The camera at `share` of the way from a to b, with the size of a.
scene::Camera between(const scene::Camera& a, const scene::Camera& b, double share) {
  const scene::Camera c = reshaped(b, a.width, a.height);
  scene::Camera result = a;
  result.fx = glm::mix(a.fx, c.fx, share);
  result.fy = glm::mix(a.fy, c.fy, share);
  result.cx = glm::mix(a.cx, c.cx, share);
  result.cy = glm::mix(a.cy, c.cy, share);
  const glm::dmat3 rotation = glm::mat3_cast(
      glm::slerp(glm::quat_cast(glm::dmat3(a.world_to_camera)), glm::quat_cast(glm::dmat3(c.world_to_camera)), share));
  result.world_to_camera = glm::dmat4(rotation);
  result.world_to_camera[3] = glm::dvec4(-(rotation * glm::mix(a.centre(), c.centre(), share)), 1.0);
  return result;
}

}  // namespace

scene::Camera look_at(const glm::dvec3& eye, const glm::dvec3& target, const glm::dvec3& up, double fov, int width,
                      int height) {
  scene::Camera camera;
  camera.width = width;
  camera.height = height;
  camera.fx = camera.fy = 0.5 * height / std::tan(0.5 * fov);
  camera.cx = 0.5 * width;
  camera.cy = 0.5 * height;
  const glm::dvec3 z = glm::normalize(target - eye), x = glm::normalize(glm::cross(z, up)), y = glm::cross(z, x);
  const glm::dmat3 rotation = glm::transpose(glm::dmat3(x, y, z));
  camera.world_to_camera = glm::dmat4(rotation);
  camera.world_to_camera[3] = glm::dvec4(-(rotation * eye), 1.0);
  return camera;
}

scene::Camera reshaped(const scene::Camera& camera, int width, int height) {
  const double s = double(height) / camera.height;
  scene::Camera result = camera;
  result.width = width;
  result.height = height;
  result.fx *= s;
  result.fy *= s;
  result.cx = 0.5 * width + s * (camera.cx - 0.5 * camera.width);
  result.cy *= s;
  return result;
}

glm::dvec3 mean_up(std::span<const scene::Camera> cameras) {
  glm::dvec3 sum(0.0);
  for (const scene::Camera& c : cameras)
    sum -= glm::dvec3(c.world_to_camera[0][1], c.world_to_camera[1][1], c.world_to_camera[2][1]);
  const double length = glm::length(sum);
  return length > 1e-3 * static_cast<double>(cameras.size()) && !cameras.empty() ? sum / length : glm::dvec3(0, 1, 0);
}

Framing frame(std::span<const glm::vec3> vertices, std::span<const scene::Camera> cameras, const glm::dvec3& up) {
  Framing f;
  f.up = glm::normalize(up);
  const soup::Box box = soup::inner_box(vertices, 0.05);
  const glm::dvec3 low(box.low), high(box.high);
  f.target = 0.5 * (low + high);
  if (!cameras.empty()) {
    // In normalised coordinates cameras are at mean distance 1 from the origin and look at it.
    f.target = glm::dvec3(0.0);
    double distance = 0, fov = 0;
    for (const scene::Camera& c : cameras) {
      distance += glm::length(c.centre());
      fov += 2 * std::atan(0.5 * c.height / c.fy);
    }
    f.distance = std::max(1e-3, distance / static_cast<double>(cameras.size()));
    f.fov = fov / static_cast<double>(cameras.size());
  } else {
    f.distance = std::max(1e-3, 0.65 * glm::length(high - low) / std::tan(0.5 * f.fov));
  }
  return f;
}

std::vector<scene::Camera> orbit(const Framing& framing, int count, double elevation, double start, int width,
                                 int height) {
  std::vector<scene::Camera> cameras;
  for (int i = 0; i < count; ++i)
    cameras.push_back(around(framing, start + 2 * std::numbers::pi * i / count, elevation, width, height));
  return cameras;
}

std::vector<scene::Camera> hemisphere(const Framing& framing, int count, int width, int height) {
  const double golden_angle = std::numbers::pi * (3 - std::sqrt(5.0));
  std::vector<scene::Camera> cameras;
  for (int i = 0; i < count; ++i)
    cameras.push_back(around(framing, golden_angle * i, std::asin((i + 0.5) / count), width, height));
  return cameras;
}

std::vector<scene::Camera> along(std::span<const scene::Camera> stations, int count) {
  std::vector<scene::Camera> cameras;
  const std::size_t last = stations.size() - 1;
  for (int i = 0; i < count; ++i) {
    const double at = (i + 0.5) / count * static_cast<double>(last);
    const auto from = static_cast<std::size_t>(at);
    const scene::Camera a = reshaped(stations[from], stations[0].width, stations[0].height);
    cameras.push_back(between(a, stations[std::min(from + 1, last)], at - static_cast<double>(from)));
  }
  return cameras;
}

View view_of(const scene::Camera& camera, double near, double far) {
  return {scene::clip_from_world(camera, near, far), static_cast<std::uint32_t>(camera.width),
          static_cast<std::uint32_t>(camera.height)};
}

View view_of(const scene::Camera& camera, const scene::Normalisation& of_camera, const GpuModel& model, double near,
             double far) {
  View view = view_of(camera, near, far);
  glm::dmat4 camera_from_model(of_camera.scale / model.scale);
  camera_from_model[3] = glm::dvec4(of_camera.scale * (model.centre - of_camera.centre), 1.0);
  view.clip_from_world = view.clip_from_world * camera_from_model;
  return view;
}

}  // namespace trisoup::render
