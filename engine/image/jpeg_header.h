// What a JPEG says of itself before its pixels.
#pragma once

#include <cstdint>
#include <span>

namespace trisoup {

struct JpegHeader {
  int width = 0, height = 0;  // pixels, as they are stored; 0 where the bytes end before
  int orientation = 1;  // EXIF: how the camera was held, 1 to 8 (turned() says which is which); 1 where nothing is said
};

/// The header of a JPEG (is_jpeg), as far as `bytes` reach. What is damaged counts as not said.
JpegHeader jpeg_header(std::span<const std::uint8_t> bytes);

}  // namespace trisoup
