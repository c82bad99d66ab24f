// The photographs of a scene in device memory, 8 bits a channel.
#pragma once

#include <cstdint>
#include <vector>

#include "gpu/device.h"
#include "scene/scene.h"

namespace trisoup::train {

struct Photographs {
  gpu::Buffer pixels;                  // RGBA8, alpha is the loss mask
  std::vector<std::uint32_t> offsets;  // per view, in pixels
};

/// Uploads the views' images one after the other. Throws Error when they have 2^32 pixels or more, or do not fit.
Photographs upload_photographs(gpu::Device& gpu, const std::vector<scene::View>& views);

}  // namespace trisoup::train
