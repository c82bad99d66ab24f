// Scenes of boxes on a floor, whose photographs and depths are computed.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include <glm/glm.hpp>

#include "scene/normalisation.h"
#include "scene/scene.h"
#include "soup/random.h"
#include "speckle.h"

namespace trisoup::test {

struct Box {
  glm::dvec3 low, high;
};

/// z is up. Walls at -wall and wall along x and y.
struct BoxScene {
  std::vector<Box> boxes;
  double floor = 0, wall = std::numeric_limits<double>::infinity();
};

/// The room of the dataset inputs/_reference.
inline BoxScene room_with_box() { return {{{glm::dvec3(-0.6), glm::dvec3(0.6)}}, -0.6, 4.5}; }

/// Five by five houses of several heights, from -3 to 3.
inline BoxScene streets() {
  BoxScene scene;
  soup::Random random(3);
  for (int i = -2; i <= 2; ++i)
    for (int j = -2; j <= 2; ++j)
      scene.boxes.push_back(
          {{1.2 * i - 0.4, 1.2 * j - 0.4, 0}, {1.2 * i + 0.4, 1.2 * j + 0.4, random.uniform(0.3, 1)}});
  return scene;
}

/// The first surface that a ray from outside all boxes meets.
struct Hit {
  double distance = std::numeric_limits<double>::infinity();  // in units of the ray
  int axis = 0;                                               // of the surface's normal
  bool on_box = false;
};

inline Hit first_hit(const BoxScene& scene, const glm::dvec3& eye, const glm::dvec3& ray) {
  Hit hit;
  const auto take = [&](double distance, int axis, bool on_box) {
    if (distance > 0 && distance < hit.distance) hit = {distance, axis, on_box};
  };
  for (const int k : {0, 1}) take((std::copysign(scene.wall, ray[k]) - eye[k]) / ray[k], k, false);
  if (ray.z < 0) take((scene.floor - eye.z) / ray.z, 2, false);
  for (const Box& box : scene.boxes) {
    const glm::dvec3 a = (box.low - eye) / ray, b = (box.high - eye) / ray, enter = glm::min(a, b),
                     leave = glm::max(a, b);
    const int axis = enter.x > enter.y ? (enter.x > enter.z ? 0 : 2) : (enter.y > enter.z ? 1 : 2);
    if (enter[axis] < std::min({leave.x, leave.y, leave.z})) take(enter[axis], axis, true);
  }
  return hit;
}

/// Direction to a place in the picture, pixels; its depth is 1.
inline glm::dvec3 ray_through(const scene::Camera& c, double x, double y) {
  return glm::transpose(glm::dmat3(c.world_to_camera)) * glm::dvec3((x - c.cx) / c.fx, (y - c.cy) / c.fy, 1);
}

/// Depth of a place in the picture, pixels, of a camera in normalised coordinates.
inline double depth_at(const BoxScene& scene, const scene::Normalisation& normalisation, const scene::Camera& camera,
                       double x, double y) {
  const glm::dvec3 eye = normalisation.to_world(camera.centre());
  return normalisation.scale * first_hit(scene, eye, ray_through(camera, x, y)).distance;
}

/// Grey of a place: coarse speckles; fine ones too on boxes and on the floor of a room.
inline double grey_at(const BoxScene& scene, const Hit& hit, const glm::dvec3& p) {
  const double u = p[hit.axis == 0 ? 1 : 0] + 17.0 * hit.axis,
               v = p[hit.axis == 2 ? 1 : 2] + (p[hit.axis] > 0 ? 31 : 0);
  const double coarse = speckle(1.2 * u + 50, 1.2 * v);
  const bool fine = hit.on_box || (hit.axis == 2 && std::isfinite(scene.wall));
  return fine ? 0.5 * (coarse + speckle(7 * u, 7 * v)) : coarse;
}

/// The photograph of a camera in the scene's coordinates, from 2 x 2 rays per pixel.
inline Image photograph(const BoxScene& scene, const scene::Camera& camera) {
  Image image{camera.width, camera.height, {}};
  const glm::dvec3 eye = camera.centre();
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      double sum = 0;
      for (const double dx : {0.25, 0.75})
        for (const double dy : {0.25, 0.75}) {
          const glm::dvec3 ray = ray_through(camera, x + dx, y + dy);
          const Hit hit = first_hit(scene, eye, ray);
          sum += grey_at(scene, hit, eye + hit.distance * ray);
        }
      const auto grey = static_cast<std::uint8_t>(sum / 4 + 0.5);
      image.rgba.insert(image.rgba.end(), {grey, grey, grey, 255});
    }
  return image;
}

/// A camera of 96 x 72 pixels that looks at the origin.
inline scene::Camera camera_towards_origin(const glm::dvec3& eye) {
  const glm::dvec3 forward = glm::normalize(-eye), right = glm::normalize(glm::cross(forward, glm::dvec3(0, 0, 1))),
                   down = glm::cross(forward, right);
  scene::Camera c;
  c.width = 96, c.height = 72, c.fx = c.fy = 90, c.cx = 48, c.cy = 36;
  c.world_to_camera =
      glm::inverse(glm::dmat4(glm::dvec4(right, 0), glm::dvec4(down, 0), glm::dvec4(forward, 0), glm::dvec4(eye, 1)));
  return c;
}

/// 16 photographs from a ring of `radius` at the heights low, middle and high in turn, in normalised coordinates.
inline std::vector<scene::View> photographs_round(const BoxScene& scene, const scene::Normalisation& normalisation,
                                                  double radius, const glm::dvec3& heights) {
  std::vector<scene::View> views(16);
  for (int k = 0; k < 16; ++k) {
    const double turn = 3.14159265358979 * k / 8;
    const scene::Camera camera =
        camera_towards_origin({radius * std::cos(turn), radius * std::sin(turn), heights[k % 3]});
    scene::View& view = views[static_cast<std::size_t>(k)];
    view.camera = scene::normalised(camera, normalisation);
    view.image = photograph(scene, camera);
  }
  return views;
}

}  // namespace trisoup::test
