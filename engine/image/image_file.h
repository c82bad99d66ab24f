// Reads picture files of the types that picture_type.h lists. Writes PNG and WebP files.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "image/image.h"
#include "image/value_map.h"

namespace trisoup {

struct ImageSize {
  int width = 0, height = 0;  // pixels, as stored in the file
  int orientation = 1;        // EXIF orientation of a JPEG, PNG, WebP or TIFF; see turned()
  double focal_length = 0;    // by EXIF of a JPEG, millimetres; 0: unknown
};

/// Reads the size from the header of a file without decoding it. Throws Error for types that are not read, by their
/// name and with the command that converts them, for damaged headers, and for more than 2^28 pixels.
ImageSize image_size(const std::filesystem::path& path);

struct DecodeOptions {
  /// With 2, 4 or 8, a JPEG may be decoded at a reduced size, with its sides divided by it and rounded up, which saves
  /// memory. Other files are decoded at full size.
  int divisor = 1;
  /// Convert colours to sRGB as the file's colour profile prescribes (see convert_to_srgb). For photographs. The values
  /// of masks and of textures are not colours, so they must stay as stored.
  bool to_srgb = false;
  /// Receives what the decoder worked around, if not null: phrases about several photographs, such as "lack the end
  /// marker of a JPEG; ...".
  std::vector<std::string>* notes = nullptr;
};

/// Decodes a picture to straight (not premultiplied) RGBA. Alpha is 255 if the file has none. Channels of more than 8
/// bits keep their upper 8 bits. The EXIF orientation is ignored, as tools that estimate poses do; HEIC and AVIF are
/// turned as they prescribe. Animations give their first picture, or Error. A JPEG that lacks nothing but its end
/// marker is decoded, with a note. Throws Error that begins with `name` for types that are not read (see image_size)
/// and for truncated or damaged files.
Image decode_image(std::span<const std::byte> bytes, const std::string& name, const DecodeOptions& options = {});

/// Reads and decodes a file (see decode_image).
Image read_image(const std::filesystem::path& path, const DecodeOptions& options = {});

/// Reads and decodes a photograph, with colours in sRGB. divisor, notes: see DecodeOptions.
Image read_photograph(const std::filesystem::path& path, int divisor = 1, std::vector<std::string>* notes = nullptr);

/// Reads a picture of numbers: a PNG or TIFF with one channel, a TIFF of floats, or a .npy file (npy_file.h). An 8-bit
/// PNG may have three equal channels. Values are as stored; see ValueMap. Throws Error that begins with the path for
/// other types, for colours, and for truncated and damaged files.
ValueMap read_values(const std::filesystem::path& path);

/// The same from the bytes of a file. name: the file, for messages.
ValueMap decode_values(std::span<const std::byte> bytes, const std::string& name);

/// Applies an EXIF orientation, so that the image is upright. 1: unchanged; 2: mirrored left to right; 3: rotated by
/// 180 degrees; 4: mirrored top to bottom; 5 to 8: width and height are exchanged (6: rotated clockwise by 90 degrees).
Image turned(Image image, int orientation);

/// Returns true if the bytes are a JPEG file, whose pixel values are only approximate.
bool is_jpeg(std::span<const std::byte> bytes);

/// Encodes an 8-bit PNG: RGB if every alpha is 255, else RGBA. Error messages begin with `name`.
std::string encode_png(const Image& image, const std::string& name);

/// Encodes a lossy WebP without alpha, for web pages. quality: 0 to 100. Throws Error that begins with `name` if a side
/// has more than 16383 pixels.
std::string encode_webp(const Image& image, float quality, const std::string& name);

/// Writes encode_png(image) atomically (see write_file_atomically). Throws Error if that fails or if the image is empty
/// or inconsistent.
void write_png(const std::filesystem::path& path, const Image& image);

}  // namespace trisoup
