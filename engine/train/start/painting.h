// Sums of the photographs' colours, from which textures are initialised.
#pragma once

#include <cstdint>
#include <span>

#include "gpu/device.h"
#include "train/step/batch_buffers.h"
#include "train/step/batch_view.h"
#include "train/step/exposure.h"
#include "train/step/soup_buffers.h"

namespace trisoup::train {

/// Sums the photographs' colours, without their exposures, over the visible pixels of each sample, on the finest
/// lattice of each texture of `table` (sum_photographs.comp). [lattice samples of `own`][4]: weight times red, green,
/// blue and 1. views: at full size, with their photographs on the device. own: the triangles to sum for. exposures:
/// null for none.
FixedSums sum_photographs(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers, std::span<const BatchView> views,
                          std::span<const soup::TextureEntry> table, TriangleRange own, const Exposures* exposures);

}  // namespace trisoup::train
