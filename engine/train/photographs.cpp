#include "train/photographs.h"

namespace trisoup::train {

Photographs upload_photographs(gpu::Device& gpu, const std::vector<scene::View>& views) {
  // Pools, because devices limit the size of an allocation, and the number of them.
  constexpr std::uint64_t kPoolBytes = 256u << 20;
  Photographs photos;
  for (std::size_t first = 0; first < views.size();) {
    std::uint64_t bytes = 0;
    std::size_t last = first;
    while (last < views.size() && (last == first || bytes + views[last].image.rgba.size() <= kPoolBytes))
      bytes += views[last++].image.rgba.size();
    photos.pools.push_back(gpu.allocate(bytes, "photographs"));
    gpu::Address address = photos.pools.back().address();
    for (; first < last; ++first) {
      photos.addresses.push_back(address);
      gpu.upload(address, views[first].image.rgba);
      address += views[first].image.rgba.size();
    }
  }
  return photos;
}

}  // namespace trisoup::train
