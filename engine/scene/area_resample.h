// Downscaling by exact area.
#pragma once

#include "scene/photograph.h"

namespace trisoup::scene {

/// The photograph at another size: every new pixel is the mean of the rectangle of source pixels it covers, partly
/// covered ones counted by their share. Only pixels inside the loss take part in a mean that contains any (what is
/// masked must not bleed into what is not), and the new pixel is inside where at least half of its area is. `width` and
/// `height` >= 1; for sizes above the source's the same mean gives nearest-neighbour enlargement.
Photograph area_resample(const Photograph& photograph, int width, int height);

}  // namespace trisoup::scene
