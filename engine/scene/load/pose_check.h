// Decides by the photographs how the poses of a file are meant, and whether its points belong to them.
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "scene/load/consistency.h"

namespace trisoup::scene {

/// Returns about `count` probes, evenly spaced over the cameras, reduced to `longest_side` pixels.
using TakeProbes = std::function<std::vector<Probe>(std::size_t count, int longest_side)>;

enum class PoseConvention {
  opengl_to_world,  // transforms*.json
  world_to_opencv,  // COLMAP
  unmistakable,     // formats with angles, and those of one program only
};

struct PoseCheck {
  PoseReading reading = PoseReading::as_written;
  bool points_fit = true;  // whether the file's points may be used
  std::string warning;     // one line about what was done; empty: all is as the file says
};

/// Compares points with poses; if they contradict each other, and also without points if the cameras do not look at a
/// common place, searches for points in the photographs. Another reading of the poses is chosen only if it explains the
/// photographs and the reading that the format promises does not.
/// cameras: all of the dataset, as written. points: may be empty; seen_by: indices of `cameras`. written: the
/// convention of the format. source: the file, for the warning.
PoseCheck check_poses(std::span<const Camera> cameras, const PointCloud& points, PoseConvention written,
                      const std::string& source, const TakeProbes& take_probes);

}  // namespace trisoup::scene
