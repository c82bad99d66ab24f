// A room with a box in its middle, whose depths are known: walls at +-4.5, floor at -0.6, box from -0.6 to 0.6.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include <glm/glm.hpp>

#include "scene/normalisation.h"
#include "scene/scene.h"
#include "speckle.h"

namespace trisoup::test {

inline constexpr double kRoomWall = 4.5, kRoomBox = 0.6;

/// Length, in units of `ray`, from an eye inside the room and outside the box to the first surface.
inline double room_distance(const glm::dvec3& eye, const glm::dvec3& ray) {
  double wall = std::numeric_limits<double>::infinity(), enter = 0, leave = wall;
  for (int k = 0; k < 3; ++k) {
    if (ray[k] == 0) continue;               // the eyes of the tests are not between two faces of the box
    const bool open = k == 2 && ray[k] > 0;  // no ceiling
    const double side = k == 2 ? -kRoomBox : std::copysign(kRoomWall, ray[k]);
    if (!open) wall = std::min(wall, (side - eye[k]) / ray[k]);
    const double a = (-kRoomBox - eye[k]) / ray[k], b = (kRoomBox - eye[k]) / ray[k];
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  return enter > 0 && enter < leave ? enter : wall;
}

/// Depth of a place in the picture, pixels, of a camera in normalised coordinates.
inline double room_depth(const scene::Camera& camera, const scene::Normalisation& normalisation, double x, double y) {
  const glm::dvec3 in_camera((x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy, 1);
  const glm::dvec3 ray = glm::transpose(glm::dmat3(camera.world_to_camera)) * in_camera;
  return normalisation.scale * room_distance(normalisation.to_world(camera.centre()), ray);
}

/// Grey of a place on the face whose axis is `axis`: coarse speckles on walls, fine ones too on the floor and the box.
inline double room_grey(const glm::dvec3& p, int axis) {
  const double u = p[axis == 0 ? 1 : 0] + 17.0 * axis, v = p[axis == 2 ? 1 : 2] + (p[axis] > 0 ? 31.0 : 0.0);
  const double coarse = speckle(1.2 * u + 50, 1.2 * v);
  return std::abs(p[axis]) > 4 ? coarse : 0.5 * (coarse + speckle(7 * u, 7 * v));
}

/// Distance of a place from the plane of the nearest face across an axis.
inline double distance_to_face(const glm::dvec3& p, int axis) {
  const double high = std::abs(p[axis]), box = std::abs(high - kRoomBox);
  return axis == 2 ? box : std::min(box, std::abs(high - kRoomWall));
}

/// Axis across which the face of a place on the room's surfaces lies.
inline int room_axis(const glm::dvec3& p) {
  int nearest = 0;
  for (const int axis : {1, 2})
    if (distance_to_face(p, axis) < distance_to_face(p, nearest)) nearest = axis;
  return nearest;
}

inline constexpr int kRoomWidth = 96, kRoomHeight = 72;

/// Camera `view` of `count` on a ring round the box, at three heights. Dataset units.
inline scene::Camera room_camera(int view, int count) {
  const double turn = 2 * 3.14159265358979 * view / count;
  const glm::dvec3 eye(3.2 * std::cos(turn), 3.2 * std::sin(turn), 0.7 + 0.6 * (view % 3));
  const glm::dvec3 forward = glm::normalize(-eye), right = glm::normalize(glm::cross(forward, glm::dvec3(0, 0, 1))),
                   down = glm::cross(forward, right);
  scene::Camera c;
  c.width = kRoomWidth, c.height = kRoomHeight, c.fx = c.fy = 90, c.cx = 0.5 * kRoomWidth, c.cy = 0.5 * kRoomHeight;
  c.world_to_camera =
      glm::inverse(glm::dmat4(glm::dvec4(right, 0), glm::dvec4(down, 0), glm::dvec4(forward, 0), glm::dvec4(eye, 1)));
  return c;
}

/// Grey of a pixel of a camera in dataset units, from 2 x 2 rays.
inline std::uint8_t room_pixel(const scene::Camera& camera, int x, int y) {
  double sum = 0;
  for (const double dx : {0.25, 0.75})
    for (const double dy : {0.25, 0.75}) {
      const double depth = room_depth(camera, {}, x + dx, y + dy);
      const glm::dvec4 place =
          glm::inverse(camera.world_to_camera) *
          glm::dvec4(depth * (x + dx - camera.cx) / camera.fx, depth * (y + dy - camera.cy) / camera.fy, depth, 1);
      sum += room_grey(glm::dvec3(place), room_axis(glm::dvec3(place)));
    }
  return static_cast<std::uint8_t>(sum / 4 + 0.5);
}

/// `count` photographs, in normalised coordinates.
inline std::vector<scene::View> room_photographs(int count, const scene::Normalisation& normalisation) {
  std::vector<scene::View> views(static_cast<std::size_t>(count));
  for (int k = 0; k < count; ++k) {
    scene::View& view = views[static_cast<std::size_t>(k)];
    const scene::Camera camera = room_camera(k, count);
    view.camera = scene::normalised(camera, normalisation);
    view.image = {kRoomWidth, kRoomHeight, {}};
    for (int y = 0; y < kRoomHeight; ++y)
      for (int x = 0; x < kRoomWidth; ++x) {
        const std::uint8_t grey = room_pixel(camera, x, y);
        view.image.rgba.insert(view.image.rgba.end(), {grey, grey, grey, 255});
      }
  }
  return views;
}

}  // namespace trisoup::test
