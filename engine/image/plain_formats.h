// BMP, GIF, TGA, PSD and the PBM family.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "image/image.h"
#include "image/picture_type.h"

namespace trisoup {

struct PlainPicture {
  std::int64_t width = 0, height = 0;  // pixels; 0: the header is cut off
  /// What prevents decoding, for messages ("cut off before its end"); null: nothing.
  const char* problem = nullptr;
  bool opaque = false;  // alpha in the file has no meaning
  std::string icc{};    // ICC profile; empty: none
};

/// Reads size and colour profile from a whole BMP, GIF, TGA, PSD or file of the PBM family, and checks it: stb_image
/// fills missing data with zeros, reads tables that were never set, and decodes some variants wrongly. `problem` names
/// what it finds, and variants that are not read: run-length coding in BMP, GIF whose first picture is smaller than the
/// whole, TGA from right to left or without the flag of rows from the top, PSD with other than three channels of 8 bits
/// or without merged picture. Sources: Microsoft's documentation of BITMAPV5HEADER, GIF89a (CompuServe 1990),
/// Truevision TGA 2.0, Adobe Photoshop File Formats Specification (2019), netpbm's manual pages.
PlainPicture examine_plain(PictureKind kind, std::span<const std::uint8_t> bytes);

/// Decodes a file of the PBM family (P1 to P6) that examine_plain() found no problem with. Samples are scaled to 255;
/// those of 16 bits keep their upper 8. Throws Error that begins with `name` for text that is not numbers.
Image decode_pnm(std::span<const std::uint8_t> bytes, const std::string& name);

}  // namespace trisoup
