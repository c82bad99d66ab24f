// The 8-bit image that views, the trainer's pictures and PNG files share.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace trisoup {

/// 8-bit RGBA image, row 0 on top. In a View, RGB is already composited on the background and A is the loss mask:
/// 255 where the pixel takes part in the loss and in the metrics, 0 where it does not.
struct Image {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgba;  // height * width * 4
};

/// Whether a View's image has a pixel that takes part in the loss.
inline bool has_pixels(const Image& image) {
  for (std::size_t i = 3; i < image.rgba.size(); i += 4)
    if (image.rgba[i] >= 128) return true;
  return false;
}

}  // namespace trisoup
