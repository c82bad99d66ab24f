// The first directory of a TIFF file, which is also the form of EXIF data.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

namespace trisoup {

/// Reads single numbers from the first directory of a TIFF (Adobe TIFF 6.0, section 2). Bytes that are damaged or
/// missing count as absent fields, so that a part of a file or damaged EXIF data can be read too. BigTIFF has no
/// fields here.
class TiffDirectory {
 public:
  /// tiff: bytes from the byte-order mark II or MM on; they must outlive this object.
  explicit TiffDirectory(std::span<const std::uint8_t> tiff);

  bool has(std::uint16_t tag) const;
  /// Returns the only value of a field of type SHORT or LONG, or nullopt.
  std::optional<std::uint32_t> value(std::uint16_t tag) const;

 private:
  std::uint32_t number(std::size_t at, std::size_t bytes) const;
  /// Returns the position of a field's entry, or 0.
  std::size_t entry(std::uint16_t tag) const;

  std::span<const std::uint8_t> tiff_;
  bool little_ = false;
  std::size_t first_ = 0, count_ = 0;  // position and number of the entries
};

/// Returns the orientation (see turned()) in EXIF data, which may begin with "Exif\0\0". Returns 1 if there is none.
int exif_orientation(std::span<const std::uint8_t> exif);

}  // namespace trisoup
