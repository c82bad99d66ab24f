#include "scene/intrinsics.h"

#include <cmath>
#include <optional>

#include "base/error.h"
#include "base/printable.h"

namespace trisoup::scene {
namespace {

/// Returns the size of an image with the principal point at its centre, as a multiple of the camera's size. Returns
/// nullopt if that multiple is near 1 or differs between the axes.
std::optional<double> middle_of_another_size(const Camera& camera) {
  const double x = 2 * camera.cx / camera.width, y = 2 * camera.cy / camera.height;
  // In a real camera, the principal point is off the centre by a few percent, and differently along each axis.
  const bool alike = x > 0 && y > 0 && std::abs(x / y - 1)<0.1, far = std::abs(std::sqrt(x * y) - 1)> 0.2;
  return alike && far ? std::optional(std::sqrt(x * y)) : std::nullopt;
}

std::string likely_cause(const Camera& camera, double times) {
  return fmt::format(
      "these are likely the intrinsics of the photograph at {:.0f} x {:.0f} pixels; state that size with them (w and h "
      "in transforms.json, the camera's size in a COLMAP model), or divide fx, fy, cx and cy by {:.3g}",
      times * camera.width, times * camera.height, times);
}

struct Doubts {
  std::size_t count = 0;
  std::string first;
  void add(const std::string& line) {
    if (count++ == 0) first = line;
  }
};

}  // namespace

void check_intrinsics(std::span<const Frame> frames, const std::function<void(const std::string&)>& warn) {
  Doubts middles, fields;
  for (const Frame& frame : frames) {
    const Camera& camera = frame.camera;
    const std::string name = printable(frame.photograph.name);
    const auto times = middle_of_another_size(camera);
    if (!(camera.cx > 0 && camera.cy > 0 && camera.cx < camera.width && camera.cy < camera.height))
      throw Error("{}: the principal point ({:.6g}, {:.6g}) of {} lies outside its image of {} x {} pixels; {}",
                  frame.source, camera.cx, camera.cy, name, camera.width, camera.height,
                  times ? likely_cause(camera, *times) : "correct cx and cy");
    if (times)
      middles.add(fmt::format(
          "{}: the principal point ({:.6g}, {:.6g}) of {} is far from the centre of its {} x {} pixels; {}",
          frame.source, camera.cx, camera.cy, name, camera.width, camera.height, likely_cause(camera, *times)));
    else if (std::abs(frame.focal_times - 1) > 0.2)
      fields.add(fmt::format("{}: the focal length of {}, {:.6g} pixels, contradicts camera_angle_x; {}", frame.source,
                             name, camera.fx, likely_cause(camera, frame.focal_times)));
  }
  for (const Doubts& doubts : {middles, fields})
    if (doubts.count > 0 && warn)
      warn(fmt::format("{} ({} of {} photographs)", doubts.first, doubts.count, frames.size()));
}

}  // namespace trisoup::scene
