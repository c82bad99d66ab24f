// PNG and JPEG files in, PNG files out.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

#include "image/image.h"

namespace trisoup {

struct ImageSize {
  int width = 0, height = 0;  // pixels
};

/// The size a PNG or JPEG file states in its header, without decoding it. Throws Error if it is neither.
ImageSize image_size(const std::filesystem::path& path);

/// Decodes a whole PNG or JPEG to straight (not premultiplied) RGBA; alpha is 255 where the format has none, 16-bit
/// channels keep their upper 8 bits. An EXIF orientation is ignored, as the tools that estimate poses ignore it.
/// Throws Error, naming `name`, on any other format and on a file that is cut or damaged.
Image decode_image(std::span<const std::byte> bytes, const std::string& name);

/// decode_image of the content of a file.
Image read_image(const std::filesystem::path& path);

/// True if the bytes are those of a JPEG, whose values are only approximate.
bool is_jpeg(std::span<const std::byte> bytes);

/// An 8-bit PNG, RGB where every alpha is 255 and RGBA otherwise. `name` begins error messages.
std::string encode_png(const Image& image, const std::string& name);

/// Writes an 8-bit PNG, RGB where every alpha is 255 and RGBA otherwise, under a temporary name in the same folder that is
/// then renamed: whoever reads `path` sees the old file or the whole new one. Throws Error if that fails, and then leaves
/// no temporary file.
void write_png(const std::filesystem::path& path, const Image& image);

}  // namespace trisoup
