// Cameras between key frames: the same at each time as in web pages (web/shot.js).
#pragma once

#include <optional>
#include <span>
#include <vector>

#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>

#include "scene/camera.h"

namespace trisoup::render {

/// A camera in a form that can be interpolated. Normalised coordinates.
struct Shot {
  glm::dvec3 eye{0.0};
  glm::dquat turn{1, 0, 0, 0};  // world to camera, OpenCV axes
  double height = 1;            // of its image at distance 1
  double aspect = 1;            // width / height of its image
};

struct KeyShot {
  double time = 0;  // seconds
  Shot shot;
};

struct CameraPath {
  std::vector<KeyShot> keys;       // at least one; times ascend
  bool loop = false;               // the end is followed by the start
  std::optional<double> fps;       // set if each key frame is one picture (nerfstudio)
  std::optional<glm::ivec2> size;  // of its pictures, pixels

  double seconds() const { return keys.back().time; }
};

/// Returns the shot at a time: a Catmull-Rom spline through the eyes (Catmull and Rom, 1974; tangents by the distance
/// of the neighbours in time), rotations at constant speed (slerp: Shoemake, 1985). Before the first key frame and
/// after the last one, those. keys: not empty.
Shot shot_at(std::span<const KeyShot> keys, double time);

/// Returns the camera of a shot for an image size. Images narrower than the shot's show its width and more height.
scene::Camera camera_of(const Shot& shot, int width, int height);

/// Returns the shot of a camera, without the offset of its principal point. Its field of view is 1 to 170 degrees and
/// its aspect 0.1 to 10, as files allow.
Shot shot_of(const scene::Camera& camera);

/// Returns the times of the pictures of a path: `fps` of them each second from 0, up to the end of the path or, if it
/// loops, before it. Without `fps` the times of the key frames if each is a picture, else 30 a second. Throws Error for
/// more than 100,000 pictures.
std::vector<double> picture_times(const CameraPath& path, std::optional<double> fps);

}  // namespace trisoup::render
