// Chunks of PNG files: damage, orientation and colours.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "image/colour_profile.h"

namespace trisoup {

/// Returns what is wrong with a PNG, or null: a file that is cut off, a wrong checksum, or the variant of iOS apps,
/// whose colours are in another order.
const char* png_damage(std::span<const std::uint8_t> png);

/// Reads up to `count` bytes at a position of a file.
using ReadBytes = std::function<std::string(std::uint64_t at, std::size_t count)>;

/// Returns the EXIF orientation of a PNG (see turned()), from eXIf or from the text that ImageMagick writes. Returns 1
/// if there is none, or if the chunks are damaged. Does not read the pixels.
int png_orientation(const ReadBytes& read);

/// Returns the colour space from cICP, iCCP, sRGB, or gAMA and cHRM, in this order (PNG, third edition, section 4.3).
/// A curve within 5 % of 1/2.2 and primaries near those of sRGB count as sRGB. Throws Error that begins with `name` for
/// high dynamic range.
ColourSpace png_colours(std::span<const std::uint8_t> png, const std::string& name, std::vector<std::string>* notes);

}  // namespace trisoup
