// WebP and TIFF files, with libwebp and libtiff.
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

/// Called with the size in the header before memory is allocated. Throws Error if the size is too large.
using CheckSize = std::function<void(ImageSize)>;

/// The functions below read the size in the header, or decode the first picture of a file like decode_image(). They
/// throw Error that begins with `name` for damaged files, animations, and TIFF with more than four channels or other
/// than 8 or 16 bits.
ImageSize webp_size(std::span<const std::byte> bytes, const std::string& name);
Image decode_webp(std::span<const std::byte> bytes, const std::string& name, const CheckSize& check);
ImageSize tiff_size(std::span<const std::byte> bytes, const std::string& name);
Image decode_tiff(std::span<const std::byte> bytes, const std::string& name, const CheckSize& check);

}  // namespace trisoup
