// Textures that show what the photographs show, before the first step.
#pragma once

#include <cstdint>
#include <span>

#include "gpu/device.h"
#include "train/step/batch_buffers.h"
#include "train/step/batch_view.h"
#include "train/step/soup_buffers.h"

namespace trisoup::train {

/// Colours of the photographs by the samples that show them, on the finest lattice of each texture of `table`. [lattice
/// samples of `own`][4]: weight times red, green, blue and 1 (sum_photographs.comp). views: those of the photographs
/// that `soup` is seen in, with photographs on the device, at their size. own: the triangles to sum for.
FixedSums sum_photographs(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers, std::span<const BatchView> views,
                          std::span<const soup::TextureEntry> table, TriangleRange own);

}  // namespace trisoup::train
