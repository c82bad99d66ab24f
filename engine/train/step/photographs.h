// The photographs of a scene in device memory, 8 bits per channel, and their depth maps.
#pragma once

#include <vector>

#include "gpu/device.h"
#include "scene/scene.h"

namespace trisoup::train {

struct Photographs {
  std::vector<gpu::Buffer> pools;       // RGBA8, alpha is the loss mask, or floats; each pool holds several pictures
  std::vector<gpu::Address> addresses;  // of each view's first pixel
};

/// Uploads the images, or those of the views. Throws gpu::OutOfMemory if they do not fit.
Photographs upload_photographs(gpu::Device& gpu, const std::vector<Image>& images);
Photographs upload_photographs(gpu::Device& gpu, const std::vector<scene::View>& views);

/// Uploads the depth maps of the views (scene::MeasuredDepth::inverse). The address of a view without one is 0. Throws
/// gpu::OutOfMemory if they do not fit.
Photographs upload_depths(gpu::Device& gpu, const std::vector<scene::View>& views);

}  // namespace trisoup::train
