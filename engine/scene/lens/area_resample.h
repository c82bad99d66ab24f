// Area resampling of photographs.
#pragma once

#include "scene/lens/photograph.h"

namespace trisoup::scene {

/// Resizes a photograph. Every new pixel is the mean of the source pixels that it covers, weighted by the covered area.
/// If any of them are in the loss, the mean uses only those, so that masked colours do not bleed into the rest. The new
/// pixel is in the loss if at least half of its area is. `width` and `height` must be at least 1. For larger sizes,
/// this gives nearest-neighbour enlargement.
Photograph area_resample(const Photograph& photograph, int width, int height);

}  // namespace trisoup::scene
