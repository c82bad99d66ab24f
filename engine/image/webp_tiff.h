// WebP and TIFF, by libwebp and libtiff.
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string>

#include "image/image.h"
#include "image/image_file.h"

namespace trisoup {

bool is_webp(std::span<const std::byte> bytes);
bool is_tiff(std::span<const std::byte> bytes);

/// Called with the size that a file claims, before memory is taken for it; throws where that is too much.
using CheckSize = std::function<void(ImageSize)>;

/// The size in the header, and the pixels as decode_image() gives them, of the first picture of a file. `name` begins
/// messages. Both throw Error on damage, and on what is not read: animations, TIFF of other than 8 or 16 bits, or of
/// more than four channels.
ImageSize webp_size(std::span<const std::byte> bytes, const std::string& name);
Image decode_webp(std::span<const std::byte> bytes, const std::string& name, const CheckSize& check);
ImageSize tiff_size(std::span<const std::byte> bytes, const std::string& name);
Image decode_tiff(std::span<const std::byte> bytes, const std::string& name, const CheckSize& check);

}  // namespace trisoup
