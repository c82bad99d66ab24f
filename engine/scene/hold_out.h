// Validation views: training views that are held out.
#pragma once

#include <cstddef>

#include "scene/scene.h"

namespace trisoup::scene {

/// Moves `count` training views, evenly spaced in name order, to scene.validation, and updates seen_by of the points.
/// Throws Error unless more views remain for training than are held out.
void hold_out(Scene& scene, std::size_t count);

/// Returns the default number of validation views: a tenth of the training views, from 3 to 24, but fewer than half.
std::size_t usual_validation_views(const Scene& scene);

}  // namespace trisoup::scene
