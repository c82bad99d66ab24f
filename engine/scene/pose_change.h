// Small changes of cameras' poses.
#pragma once

#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "scene/camera.h"

namespace trisoup::scene {

/// turn: rotation of a camera about its own centre, a vector along the axis in world space whose length is the angle in
/// radians. shift: movement of its centre, world space.
struct PoseChange {
  glm::dvec3 turn{0.0}, shift{0.0};
};

/// The camera after the change. Without a change the same bits.
Camera changed(const Camera& camera, const PoseChange& change);

/// The changes without the small similarity transform of the whole scene that explains most of them, in the sense of
/// least squares: it moves all cameras and what they see alike, so photographs cannot tell it, and cameras that are not
/// changed would be left behind. cameras: of the same length, normalised coordinates.
std::vector<PoseChange> without_common(std::span<const Camera> cameras, std::span<const PoseChange> changes);

}  // namespace trisoup::scene
