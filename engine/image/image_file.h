// PNG, JPEG, WebP and TIFF files in, PNG and WebP files out.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

#include "image/image.h"

namespace trisoup {

struct ImageSize {
  int width = 0, height = 0;  // pixels, as they are stored
  int orientation = 1;        // EXIF, of JPEG: how the camera was held; see turned()
};

/// The size a PNG, JPEG, WebP or TIFF file states in its header, without decoding it. Throws Error if it is none of
/// them, and on more than 2^28 pixels.
ImageSize image_size(const std::filesystem::path& path);

/// Decodes a whole PNG, JPEG, WebP or TIFF to straight (not premultiplied) RGBA; alpha is 255 where the format has
/// none, 16-bit channels keep their upper 8 bits. An EXIF orientation is ignored, as the tools that estimate poses
/// ignore it. `divisor` 2, 4 or 8: a JPEG may come with its sides divided by it, rounded up, in as much less memory;
/// other files come whole. Throws Error, naming `name`, on any other format and on a file that is cut or damaged.
Image decode_image(std::span<const std::byte> bytes, const std::string& name, int divisor = 1);

/// decode_image of the content of a file.
Image read_image(const std::filesystem::path& path, int divisor = 1);

/// The image as it is seen where the camera was held as EXIF's orientation says: 2 to 4 mirrored, upside down, both; 5
/// to 8 with width and height exchanged (6: turned clockwise by a quarter). 1 leaves it as it is.
Image turned(Image image, int orientation);

/// True if the bytes are those of a JPEG, whose values are only approximate.
bool is_jpeg(std::span<const std::byte> bytes);

/// An 8-bit PNG, RGB where every alpha is 255 and RGBA otherwise. `name` begins error messages.
std::string encode_png(const Image& image, const std::string& name);

/// A lossy WebP without alpha, for pages; quality: 0 to 100. Throws Error, beginning with `name`, on sides of more than
/// 16383 pixels.
std::string encode_webp(const Image& image, float quality, const std::string& name);

/// Writes an 8-bit PNG, RGB where every alpha is 255 and RGBA otherwise, under a temporary name in the same folder that
/// is then renamed: whoever reads `path` sees the old file or the whole new one. Throws Error if that fails, and then
/// leaves no temporary file.
void write_png(const std::filesystem::path& path, const Image& image);

}  // namespace trisoup
