// A directory of a TIFF file, which is also the form of EXIF data.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace trisoup {

/// Reads single fields of a TIFF directory (Adobe TIFF 6.0, section 2). Bytes that are damaged or missing count as
/// absent fields, so that a part of a file or damaged EXIF data can be read too. BigTIFF has no fields here.
class TiffDirectory {
 public:
  /// tiff: bytes from the byte-order mark II or MM on; they must outlive this object. position: of the directory in
  /// these bytes; 0: the first directory.
  explicit TiffDirectory(std::span<const std::uint8_t> tiff, std::size_t position = 0);

  bool has(std::uint16_t tag) const;
  /// Returns the only value of a field of type SHORT or LONG, or nullopt.
  std::optional<std::uint32_t> value(std::uint16_t tag) const;
  /// Returns the only value of a field of type RATIONAL, or nullopt; also for a denominator of 0.
  std::optional<double> ratio(std::uint16_t tag) const;
  /// Returns the first characters of a field of type ASCII, at most four, without the final zero.
  std::string_view short_text(std::uint16_t tag) const;

 private:
  std::uint32_t number(std::size_t at, std::size_t bytes) const;
  /// Returns the position of a field's entry, or 0.
  std::size_t entry(std::uint16_t tag) const;

  std::span<const std::uint8_t> tiff_;
  bool little_ = false;
  std::size_t first_ = 0, count_ = 0;  // position and number of the entries
};

struct Exif {
  int orientation = 1;      // 1 to 8 (see turned()); 1 if there is none
  double focal_length = 0;  // millimetres; 0: unknown
  bool adobe_rgb = false;   // the colours are those of Adobe RGB, as cameras write it that embed no colour profile
};

/// Reads EXIF data (Exif 2.32, CIPA DC-008), which may begin with "Exif\0\0". Damaged parts count as missing.
Exif read_exif(std::span<const std::uint8_t> bytes);

}  // namespace trisoup
