// A smooth movement from one camera to another.
#pragma once

#include <glm/glm.hpp>

#include "scene/camera.h"

namespace trisoup::viewer {

/// A camera and the distance from its eye to the point that it orbits.
struct Aimed {
  scene::Camera camera;
  double distance = 1;
};

/// The camera between a (share = 0) and b (share = 1). It turns around what they look at, so that the way does not lead
/// through it, and has the image size of b. As in web/shot.js.
Aimed between(const Aimed& a, const Aimed& b, double share);

/// Slow at both ends. share: 0 to 1.
constexpr double eased(double share) { return share * share * (3 - 2 * share); }

/// Durations in seconds, as on the web page.
inline constexpr double kFlightSeconds = 0.8, kPivotSeconds = 0.4;

struct Flight {
  Aimed from, to;
  double seconds = kFlightSeconds;
  double time = 0;       // since the start, seconds
  bool to_view = false;  // the end is a view of the dataset
  Aimed now() const { return between(from, to, eased(glm::min(1.0, time / seconds))); }
  bool arrived() const { return time >= seconds; }
};

}  // namespace trisoup::viewer
