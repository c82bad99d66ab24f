// Plausibility checks of camera intrinsics.
#pragma once

#include <functional>
#include <span>
#include <string>

#include "scene/dataset.h"

namespace trisoup::scene {

/// Detects intrinsics that belong to another size of the same photograph. The usual mistake is to combine reduced
/// images with intrinsics of the full size. Throws Error if a principal point lies outside the image. Gives one warning
/// for principal points that would be the centre of a larger or smaller image with the same proportions, and one for
/// focal lengths that contradict the field of view in the file.
void check_intrinsics(std::span<const Frame> frames, const std::function<void(const std::string&)>& warn);

}  // namespace trisoup::scene
