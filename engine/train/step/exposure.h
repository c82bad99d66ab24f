// Exposures of the training photographs on the device (shaders/common/exposure.h; docs/method.md, "Exposure").
#pragma once

#include <cstdint>

#include "gpu/device.h"
#include "train/step/soup_buffers.h"

namespace trisoup::train {

/// From the scene's colours to those of each photograph: gains of red, green and blue and the variance of a gain, then
/// offsets and a 0.
struct Exposures {
  std::uint32_t photographs = 0;
  gpu::Buffer fitted;  // [photographs][2][4]: to the scene's colours as they were when the photograph was last shown
  gpu::Buffer
      exposure;    // [photographs][2][4]: what is believed of it beyond the mean of all, which is what a step takes
  FixedSums sums;  // [views of a batch][4][4], empty between steps
};

/// Identities for `photographs` photographs, of which a batch shows at most `views`.
Exposures allocate_exposures(gpu::Device& gpu, std::uint32_t photographs, std::uint32_t views);

}  // namespace trisoup::train
