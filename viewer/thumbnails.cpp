#include "thumbnails.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>

namespace trisoup::viewer {

Image thumbnail(const Image& image, int height) {
  Image small;
  small.height = std::min(image.height, std::max(1, height));
  small.width = std::max(1, image.width * small.height / std::max(1, image.height));
  small.rgba.resize(std::size_t(small.width) * small.height * 4, 255);
  for (int y = 0; y < small.height; ++y)
    for (int x = 0; x < small.width; ++x) {
      const int left = x * image.width / small.width, right = std::max(left + 1, (x + 1) * image.width / small.width);
      const int top = y * image.height / small.height,
                bottom = std::max(top + 1, (y + 1) * image.height / small.height);
      std::array<std::uint32_t, 3> sum{};
      for (int row = top; row < bottom; ++row)
        for (int column = left; column < right; ++column)
          for (std::size_t c = 0; c < 3; ++c) sum[c] += image.rgba[(std::size_t(row) * image.width + column) * 4 + c];
      const auto pixels = static_cast<std::uint32_t>((right - left) * (bottom - top));
      for (std::size_t c = 0; c < 3; ++c)
        small.rgba[(std::size_t(y) * small.width + x) * 4 + c] = static_cast<std::uint8_t>(sum[c] / pixels);
    }
  return small;
}

const gpu::Image* Thumbnails::find(const std::string& name, const Image& photograph, int height) {
  constexpr int kMostPerFrame = 4;
  if (height != height_) images_.clear();
  height_ = height;
  if (const auto it = images_.find(name); it != images_.end()) return &it->second;
  if (++made_ > kMostPerFrame) return nullptr;
  const Image small = thumbnail(photograph, height);
  gpu::Image& image = images_[name];
  image = graphics_.create_image(
      {gpu::Format::rgba8, static_cast<std::uint32_t>(small.width), static_cast<std::uint32_t>(small.height)},
      "thumbnail");
  graphics_.upload(image, 0, std::as_bytes(std::span(small.rgba)));
  return &image;
}

}  // namespace trisoup::viewer
