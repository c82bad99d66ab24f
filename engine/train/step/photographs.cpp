#include "train/step/photographs.h"

namespace trisoup::train {
namespace {

template <typename ImageOf>
Photographs upload(gpu::Device& gpu, std::size_t count, const ImageOf& image_of) {
  // Use pools, because devices limit both the size and the number of allocations.
  constexpr std::uint64_t kPoolBytes = 256u << 20;
  Photographs photos;
  for (std::size_t first = 0; first < count;) {
    std::uint64_t bytes = 0;
    std::size_t last = first;
    while (last < count && (last == first || bytes + image_of(last).rgba.size() <= kPoolBytes))
      bytes += image_of(last++).rgba.size();
    photos.pools.push_back(gpu.allocate(bytes, "photographs"));
    gpu::Address address = photos.pools.back().address();
    for (; first < last; ++first) {
      photos.addresses.push_back(address);
      gpu.upload(address, image_of(first).rgba);
      address += image_of(first).rgba.size();
    }
  }
  return photos;
}

}  // namespace

Photographs upload_photographs(gpu::Device& gpu, const std::vector<Image>& images) {
  return upload(gpu, images.size(), [&](std::size_t i) -> const Image& { return images[i]; });
}

Photographs upload_photographs(gpu::Device& gpu, const std::vector<scene::View>& views) {
  return upload(gpu, views.size(), [&](std::size_t i) -> const Image& { return views[i].image; });
}

}  // namespace trisoup::train
