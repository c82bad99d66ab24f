// What each triangle, and the finest level of its texture, is worth to the pictures of the training views.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "gpu/device.h"
#include "scene/scene.h"
#include "train/exposure.h"
#include "train/frame.h"
#include "train/soup_buffers.h"
#include "train/view_record.h"

namespace trisoup::train {

/// What each pixel of a photograph (RGBA8, alpha the loss mask) counts: half of it the pixel itself, as PSNR has it, and half the lack of contrast
/// around it, as SSIM has it (Wang et al. 2004): an error over a wall's grain is seen, the same error among leaves is not. The mean over the pixels
/// in the loss is 1; the others have 0. [height * width]
std::vector<float> error_weights(const Image& photograph);

/// Squared colour errors times error_weights(), summed over the pixels of the views that were looked at (three channels, 0..1 each), that there would
/// be more of. Triangles are opaque, so a pixel is its winner's business alone: what is behind it and what its texture shows without the finest level
/// can be looked at for many triangles at once. Below zero where the picture would be better.
struct Worth {
  double error = 0;                   // of all pixels as they are
  std::vector<std::uint32_t> pixels;  // [T] that show the triangle
  std::vector<double> triangle;       // [T] without the triangle: its pixels show what is behind it
  std::vector<double> finest;         // [T] without the finest level of its texture: in between is interpolated; 0 where it has level 0 alone
  /// (a triangle, another one that one of its pixels shows without it), each pair once, in order: what the first one's worth rests on.
  std::vector<std::pair<std::uint32_t, std::uint32_t>> behind;
};

/// views: those to look at, at their own size; view.index is that of the photograph in scene.train. exposures: of the photographs; null for none.
/// most: views at a time. The soup is as before afterwards.
Worth measure_worth(gpu::Device& gpu, SoupBuffers& soup, Frame& frame, const scene::Scene& scene, std::span<const BatchView> views,
                    const Exposures* exposures, std::size_t most);

}  // namespace trisoup::train
