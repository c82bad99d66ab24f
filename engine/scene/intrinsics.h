// Whether intrinsics can be those of the pictures they come with.
#pragma once

#include <functional>
#include <span>
#include <string>

#include "scene/dataset.h"

namespace trisoup::scene {

/// Looks for intrinsics of another size of the same photograph: those of the full-size one beside reduced images are
/// the usual mistake. Throws Error where a principal point lies outside the picture (no pinhole of that picture looks
/// there). One warning each for principal points that are as far from the corner as the middle of a larger or smaller
/// picture of the same proportions, and for focal lengths that contradict the field of view beside them.
void check_intrinsics(std::span<const Frame> frames, const std::function<void(const std::string&)>& warn);

}  // namespace trisoup::scene
