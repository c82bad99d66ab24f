// Triangles that are not shown for a while.
#pragma once

#include <vector>

#include "gpu/device.h"
#include "train/soup_buffers.h"

namespace trisoup::train {

/// No pass shows the triangles of `which` ([T]) until the levels are summed again (Step::sum_textures): their opacities are 0.
void hide(gpu::Device& gpu, SoupBuffers& soup, const std::vector<bool>& which);

}  // namespace trisoup::train
