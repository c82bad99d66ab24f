// Textures that show what the photographs show, before the first step.
#pragma once

#include <span>

#include "gpu/device.h"
#include "scene/scene.h"
#include "train/frame.h"
#include "train/soup_buffers.h"
#include "train/view_record.h"

namespace trisoup::train {

/// Logits for textures laid out as `table`, with the mean of the colours that the photographs have wherever each triangle of `soup` is visible; views[i]
/// is photograph i of scene.train, at its own size. Where few pixels say anything about a sample its coarser level has a say, about the
/// coarsest level the corners of `soup`, whose textures are of level 0. Their opacities stay. [source samples of table][8]
gpu::Buffer painted_logits(gpu::Device& gpu, SoupBuffers& soup, Frame& frame, const scene::Scene& scene, std::span<const BatchView> views,
                           std::span<const soup::TextureEntry> table);

}  // namespace trisoup::train
