// HEIC, HEIF and AVIF files, with libheif.
#pragma once

#ifdef TRISOUP_HEIF

#include <cstddef>
#include <span>
#include <string>

#include "image/colour_profile.h"
#include "image/image_file.h"
#include "image/webp_tiff.h"

namespace trisoup {

/// Reads the size of the primary picture of a whole file, after the rotations and mirrorings that the file itself
/// prescribes. Its EXIF orientation describes the same rotation again, so the orientation is always 1. Throws Error
/// that begins with `name` for damaged files and for those whose coding this libheif has no decoder for.
ImageSize heif_size(std::span<const std::byte> bytes, const std::string& name);

/// Decodes the primary picture like decode_image(), with those rotations. 10 and 12 bits are reduced to 8. colours: set
/// to the colour space of the picture. Throws Error that begins with `name`, also for high dynamic range.
Image decode_heif(std::span<const std::byte> bytes, const std::string& name, const CheckSize& check,
                  ColourSpace& colours);

}  // namespace trisoup

#endif
