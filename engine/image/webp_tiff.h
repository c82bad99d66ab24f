// WebP and TIFF files, with libwebp and libtiff.
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string>

#include "image/colour_profile.h"
#include "image/image.h"
#include "image/image_file.h"
#include "image/tiff_directory.h"
#include "image/value_map.h"

namespace trisoup {

/// Called with the size in the header before memory is allocated. Throws Error if the size is too large.
using CheckSize = std::function<void(ImageSize)>;

/// Reads the size in the header. Throws Error that begins with `name` for damaged headers and animations. The
/// orientation is 1; see webp_exif().
ImageSize webp_size(std::span<const std::byte> bytes, const std::string& name);
/// Returns whether the header announces EXIF data.
bool webp_has_exif(std::span<const std::byte> bytes);
/// Reads the EXIF data of a whole file. Missing and damaged parts count as none.
Exif webp_exif(std::span<const std::byte> bytes);
/// Decodes a file like decode_image(). colours: set to the colour space of the file.
Image decode_webp(std::span<const std::byte> bytes, const std::string& name, const CheckSize& check,
                  ColourSpace& colours);

/// Reads size and orientation of the first picture in a whole file.
ImageSize tiff_size(std::span<const std::byte> bytes, const std::string& name);
/// Decodes the first picture like decode_image(). colours: set to the colour space of the pixels that are returned.
/// Lab, and CMYK with a profile, are converted to sRGB; CMYK of 8 bits without profile is converted plainly. Throws
/// Error that begins with `name` for damaged files, and for what is not supported: more than four channels, other than
/// 1 to 16 bits, CMYK of 16 bits without profile, pixels of camera sensors.
Image decode_tiff(std::span<const std::byte> bytes, const std::string& name, const CheckSize& check,
                  ColourSpace& colours);

/// Decodes a TIFF with one channel of 8 or 16 bits, or of floats of 32 bits, as stored. check, and the rest: as
/// decode_tiff().
ValueMap decode_tiff_values(std::span<const std::byte> bytes, const std::string& name, const CheckSize& check);

}  // namespace trisoup
