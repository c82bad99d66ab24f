// Size, orientation and colour profile from the header of a JPEG.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "image/tiff_directory.h"

namespace trisoup {

struct JpegHeader {
  int width = 0, height = 0;  // pixels, as stored in the file; 0 if the size was not found
  Exif exif{};
  std::string icc{};            // ICC profile; empty: none
  bool icc_incomplete = false;  // a part of the ICC profile is missing
};

/// Reads the header of a JPEG (see is_jpeg) from its first bytes. Damaged parts count as missing. The ICC profile is
/// joined from its segments (ICC.1:2010, annex B.4).
JpegHeader jpeg_header(std::span<const std::uint8_t> bytes);

}  // namespace trisoup
