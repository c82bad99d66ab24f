// Types of picture files: which are read, and how to convert the others.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

namespace trisoup {

/// Types with a decoder, and all others.
enum class PictureKind { png, jpeg, webp, tiff, heif, bmp, pnm, gif, tga, psd, other };

struct PictureType {
  std::string_view name;  // "HEIC", "JPEG XL"
  PictureKind kind = PictureKind::other;
  /// decode_image() reads it in this build. HEIC and AVIF depend on libheif.
  bool read = false;
  /// COLMAP reads it too. A copy of another type must be made for it.
  bool read_by_colmap = false;
  /// What to do with a file that is not read, a clause for messages: "convert with djxl IN OUT.png". Empty if read.
  std::string_view remedy;
};

/// Returns the type of a file from its first bytes; 4 KiB are enough. Returns nullptr if they have no known signature:
/// other content, damage, or TGA, which has none. Also knows files that take the place of a picture by accident, such
/// as web pages and Git LFS pointers. Raw photographs with the signature of TIFF are returned as TIFF if their
/// directory is not among these bytes.
const PictureType* picture_type(std::span<const std::byte> start);

/// Returns the type of a file from its first bytes, or else from the extension of its name, or nullptr. The name also
/// tells the kind of raw photographs with the signature of TIFF.
const PictureType* picture_type(std::span<const std::byte> start, const std::filesystem::path& name);

/// Returns the type for the extension of a name, in upper or lower case, or nullptr if it is not one of pictures.
const PictureType* picture_type_of_name(const std::filesystem::path& name);

/// Returns whether a name has an extension of a type that is read.
bool is_readable_picture_name(const std::filesystem::path& name);

/// Returns whether a name has an extension of photographs that are not read: HEIC, raw photographs, EXR and so on.
/// Drawings and documents, such as SVG and PDF, do not count.
bool is_unread_picture_name(const std::filesystem::path& name);

/// Returns what to do with a picture of this name, a clause for messages: "convert with djxl IN OUT.png". Empty if its
/// type is read, or is not known.
std::string picture_converter(const std::filesystem::path& name);

/// Extensions of the types that are read, lower case with dot. The most usual come first, which is the order in which
/// to look for a file whose extension is missing.
std::span<const std::string_view> readable_picture_extensions();

}  // namespace trisoup
