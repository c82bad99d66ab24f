// Size and orientation from the header of a JPEG.
#pragma once

#include <cstdint>
#include <span>

namespace trisoup {

struct JpegHeader {
  int width = 0, height = 0;  // pixels, as stored in the file; 0 if the size was not found
  int orientation = 1;        // EXIF orientation, 1 to 8 (see turned()); 1 if there is none
};

/// Reads the header of a JPEG (see is_jpeg) from its first bytes. Damaged parts count as missing.
JpegHeader jpeg_header(std::span<const std::uint8_t> bytes);

}  // namespace trisoup
