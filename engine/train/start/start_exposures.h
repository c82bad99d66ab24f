// Exposures of the training photographs before the first step.
#pragma once

#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "gpu/device.h"
#include "train/step/batch_buffers.h"
#include "train/step/batch_view.h"
#include "train/step/soup_buffers.h"

namespace trisoup::train {

/// Gains of the photographs (balanced_gains()) from the places of a surface that several of them show. Steps, which
/// compare one photograph at a time with textures, would take thousands of steps to carry brightness along a street.
/// views: at full size, with their photographs on the device. If the soup is shared, all ranks make this call.
std::vector<soup::ExposureGrid> start_exposures(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers,
                                                std::span<const BatchView> views);

}  // namespace trisoup::train
