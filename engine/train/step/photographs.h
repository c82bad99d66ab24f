// The photographs of a scene in device memory, 8 bits per channel.
#pragma once

#include <vector>

#include "gpu/device.h"
#include "scene/scene.h"

namespace trisoup::train {

struct Photographs {
  std::vector<gpu::Buffer> pools;       // RGBA8, alpha is the loss mask; each pool holds several photographs
  std::vector<gpu::Address> addresses;  // of each view's first pixel
};

/// Uploads the images, or those of the views. Throws gpu::OutOfMemory if they do not fit.
Photographs upload_photographs(gpu::Device& gpu, const std::vector<Image>& images);
Photographs upload_photographs(gpu::Device& gpu, const std::vector<scene::View>& views);

}  // namespace trisoup::train
