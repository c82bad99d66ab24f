// Damage of JPEG files, before they are decoded.
#pragma once

#include <cstdint>
#include <span>

namespace trisoup {

struct JpegCheck {
  const char* damage = nullptr;  // what is wrong; null: nothing
  /// The file ends within or after the data of its last scan, without the marker EOI. Whether pixels are missing is not
  /// known then; see jpeg_has_all_pixels(). `damage` is "cut off before its end".
  bool lacks_end = false;
};

/// Checks the segments of a JPEG. stb_image fills missing parts of a truncated JPEG with grey, and needs valid Huffman
/// tables.
JpegCheck check_jpeg(std::span<const std::uint8_t> jpeg);

}  // namespace trisoup
