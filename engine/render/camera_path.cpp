#include "render/camera_path.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"

namespace trisoup::render {

Shot shot_at(std::span<const KeyShot> keys, double time) {
  const auto next = std::find_if(keys.begin(), keys.end(), [&](const KeyShot& key) { return key.time > time; });
  if (next == keys.begin()) return keys.front().shot;
  if (next == keys.end()) return keys.back().shot;
  const KeyShot &a = *(next - 1), &b = *next;
  const KeyShot& before = next - 1 == keys.begin() ? a : *(next - 2);
  const KeyShot& after = next + 1 == keys.end() ? b : *(next + 1);
  const double seconds = b.time - a.time, t = (time - a.time) / seconds;
  const auto slope = [&](const KeyShot& from, const KeyShot& to) {
    return (to.shot.eye - from.shot.eye) * (seconds / (to.time - from.time));
  };
  // Hermite's basis.
  const double t2 = t * t, t3 = t2 * t;
  Shot shot;
  shot.eye = (2 * t3 - 3 * t2 + 1) * a.shot.eye + (t3 - 2 * t2 + t) * slope(before, b) +
             (3 * t2 - 2 * t3) * b.shot.eye + (t3 - t2) * slope(a, after);
  shot.turn = glm::normalize(glm::slerp(a.shot.turn, b.shot.turn, t));
  shot.height = glm::mix(a.shot.height, b.shot.height, t);
  shot.aspect = glm::mix(a.shot.aspect, b.shot.aspect, t);
  return shot;
}

scene::Camera camera_of(const Shot& shot, int width, int height) {
  scene::Camera camera;
  camera.width = width, camera.height = height;
  camera.fx = camera.fy = std::min(double(height), width / shot.aspect) / shot.height;
  camera.cx = 0.5 * width, camera.cy = 0.5 * height;
  const glm::dmat3 rotation = glm::mat3_cast(shot.turn);
  camera.world_to_camera = glm::dmat4(rotation);
  camera.world_to_camera[3] = glm::dvec4(-(rotation * shot.eye), 1.0);
  return camera;
}

Shot shot_of(const scene::Camera& camera) {
  Shot shot;
  shot.eye = camera.centre();
  shot.turn = glm::normalize(glm::quat_cast(glm::dmat3(camera.world_to_camera)));
  shot.height = std::clamp(camera.height / camera.fy, 0.01746, 22.86);  // 2 tan of half a degree, of 85 degrees
  shot.aspect = std::clamp((camera.width / camera.fx) / shot.height, 0.1, 10.0);
  return shot;
}

std::vector<double> picture_times(const CameraPath& path, std::optional<double> fps) {
  constexpr double kMost = 100'000, kDefault = 30, kRounding = 1e-6;
  std::vector<double> times;
  if (!fps && path.fps) {
    for (const KeyShot& key : path.keys) times.push_back(key.time);
    return times;
  }
  const double rate = fps.value_or(kDefault), pictures = path.seconds() * rate;
  if (!(pictures < kMost))
    throw Error("the path of {:.6g} seconds has more than {} pictures; lower --fps", path.seconds(), kMost);
  const double count = path.loop ? std::ceil(pictures - kRounding) : std::floor(pictures + kRounding) + 1;
  for (int i = 0; i < std::max(1.0, count); ++i) times.push_back(i / rate);
  return times;
}

}  // namespace trisoup::render
