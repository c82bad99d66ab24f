#include "train/photographs.h"

#include "error.h"

namespace trisoup::train {

Photographs upload_photographs(gpu::Device& gpu, const std::vector<scene::View>& views) {
  std::uint64_t pixels = 0;
  Photographs photos;
  for (const scene::View& view : views) {
    photos.offsets.push_back(static_cast<std::uint32_t>(pixels));
    pixels += view.image.rgba.size() / 4;
  }
  if (pixels >> 32) throw Error("dataset: {} pixels are more than the trainer can address; lower the resolution with -r", pixels);
  photos.pixels = gpu.allocate(pixels * 4, "photographs");
  for (std::size_t i = 0; i < views.size(); ++i)
    gpu.upload(photos.pixels.address() + 4ull * photos.offsets[i], views[i].image.rgba);
  return photos;
}

}  // namespace trisoup::train
