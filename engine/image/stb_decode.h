// Decoding with stb_image.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "image/image.h"
#include "image/value_map.h"

namespace trisoup {

/// Decodes a PNG, JPEG, BMP, GIF, TGA or PSD of at most 1 GiB to straight RGBA. The caller has checked the file for
/// damage and its size against limits, because stb_image checks little. Throws Error that begins with `name` if it
/// fails.
Image stb_decode(std::span<const std::uint8_t> bytes, const std::string& name);

/// Decodes a PNG of 16 bits with one channel, as stored. The rest as stb_decode().
ValueMap stb_decode_16(std::span<const std::uint8_t> bytes, const std::string& name);

/// Reads the size in the header of a PNG or JPEG. Returns why that failed, or null.
const char* stb_size(std::span<const std::uint8_t> start, int& width, int& height);

}  // namespace trisoup
