// The 8-bit image that views, the trainer's pictures and PNG files share.
#pragma once

#include <cstdint>
#include <vector>

namespace trisoup {

/// 8-bit RGBA image, row 0 on top. In a View, RGB is already composited on the background and A is the loss mask:
/// 255 where the pixel takes part in the loss and in the metrics, 0 where it does not.
struct Image {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgba;  // height * width * 4
};

}  // namespace trisoup
