// The 8-bit image type used by views, rendered pictures and image files.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace trisoup {

/// 8-bit RGBA image, row 0 at the top. In a View, RGB is already composited on the background. A is 0 if the pixel does
/// not count in the loss and in the metrics; otherwise 128 + 127 coverage, so 255 where the background is hidden.
struct Image {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgba;  // [height * width * 4]
};

/// Returns whether a View's image has a pixel that counts in the loss.
inline bool has_pixels(const Image& image) {
  for (std::size_t i = 3; i < image.rgba.size(); i += 4)
    if (image.rgba[i] >= 128) return true;
  return false;
}

}  // namespace trisoup
