// Training views that are kept from training, to judge by.
#pragma once

#include <cstddef>

#include "scene/scene.h"

namespace trisoup::scene {

/// Moves `count` training views, spread evenly over them in name order, to scene.validation. Points keep those of their
/// sightings that are of the others. Throws Error unless more views are left to train with than are held out.
void hold_out(Scene& scene, std::size_t count);

/// How many are held out where nobody says: a tenth, from 3 to 24, but fewer than a half.
std::size_t usual_validation_views(const Scene& scene);

}  // namespace trisoup::scene
