// Exposures of the training photographs on the device (shaders/common/exposure.h; docs/method.md, "Exposure").
#pragma once

#include <cstdint>

#include "gpu/device.h"
#include "train/step/soup_buffers.h"

namespace trisoup::train {

/// Gains and offsets that map the scene's colours to each photograph's. A row of 2 x 4 floats: gains of red, green and
/// blue, variance of a gain; offsets of red, green and blue, 0.
struct Exposures {
  std::uint32_t photographs = 0;
  gpu::Buffer fitted;    // [photographs][2][4]: as fitted to the rendering of the last step that used the photograph
  gpu::Buffer exposure;  // [photographs][2][4]: with the mean of all photographs removed, which steps apply
  FixedSums sums;        // [views of a batch][4][4]; zero between steps
};

/// Allocates identity exposures of `photographs` photographs. views: largest number of views in a batch.
Exposures allocate_exposures(gpu::Device& gpu, std::uint32_t photographs, std::uint32_t views);

}  // namespace trisoup::train
