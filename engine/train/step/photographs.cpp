#include "train/step/photographs.h"

#include <cstddef>
#include <cstdint>
#include <span>

namespace trisoup::train {
namespace {

/// bytes_of: the content of each picture.
template <typename BytesOf>
Photographs upload_pictures(gpu::Device& gpu, std::size_t count, const BytesOf& bytes_of, const char* what) {
  // Use pools, because devices limit both the size and the number of allocations.
  constexpr std::uint64_t kPoolBytes = 256u << 20;
  Photographs photos;
  for (std::size_t first = 0; first < count;) {
    std::uint64_t bytes = 0;
    std::size_t last = first;
    while (last < count && (last == first || bytes + bytes_of(last).size() <= kPoolBytes))
      bytes += bytes_of(last++).size();
    gpu::Address address = 0;
    if (bytes > 0) {
      photos.pools.push_back(gpu.allocate(bytes, what));
      address = photos.pools.back().address();
    }
    for (; first < last; ++first) {
      const std::span<const std::byte> picture = bytes_of(first);
      photos.addresses.push_back(picture.empty() ? 0 : address);
      if (!picture.empty()) gpu.upload(address, picture);
      address += picture.size();
    }
  }
  return photos;
}

}  // namespace

Photographs upload_photographs(gpu::Device& gpu, const std::vector<Image>& images) {
  const auto bytes_of = [&](std::size_t i) { return std::as_bytes(std::span(images[i].rgba)); };
  return upload_pictures(gpu, images.size(), bytes_of, "photographs");
}

Photographs upload_photographs(gpu::Device& gpu, const std::vector<scene::View>& views) {
  const auto bytes_of = [&](std::size_t i) { return std::as_bytes(std::span(views[i].image.rgba)); };
  return upload_pictures(gpu, views.size(), bytes_of, "photographs");
}

Photographs upload_depths(gpu::Device& gpu, const std::vector<scene::View>& views) {
  const auto bytes_of = [&](std::size_t i) { return std::as_bytes(std::span(views[i].depth.inverse)); };
  return upload_pictures(gpu, views.size(), bytes_of, "depth maps");
}

}  // namespace trisoup::train
