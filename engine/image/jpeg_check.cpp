#include "image/jpeg_check.h"

#include <bitset>
#include <cstddef>

namespace trisoup {
namespace {

using Bytes = std::span<const std::uint8_t>;

/// The Huffman tables defined so far in a JPEG, by class (0: DC, 1: AC) and number. These checks are needed because
/// stb_image does not make them: a table with more than 256 codes makes it write out of bounds, and a scan may use
/// tables that were never defined.
class HuffmanTables {
 public:
  /// Reads a DHT segment. Returns false if it is malformed.
  bool define(Bytes segment) {
    while (!segment.empty()) {
      if (segment.size() < 17 || segment[0] >> 4 > 1 || (segment[0] & 15) > 3) return false;
      std::size_t codes = 0;
      for (const std::uint8_t count : segment.subspan(1, 16)) codes += count;
      if (codes > 256 || codes > segment.size() - 17) return false;
      defined_[segment[0] >> 4][segment[0] & 15] = true;
      segment = segment.subspan(17 + codes);
    }
    return true;
  }

  /// Reads an SOS segment. Returns false if it is malformed or refers to a table that is not defined.
  bool has_those_of(Bytes segment, bool progressive) const {
    const std::size_t components = segment.empty() ? 0 : segment[0];
    if (components < 1 || components > 4 || segment.size() != 4 + 2 * components) return false;
    // A baseline scan contains all coefficients, regardless of these fields.
    const int first = progressive ? segment[2 * components + 1] : 0,
              last = progressive ? segment[2 * components + 2] : 63;
    const bool refines = progressive && segment[2 * components + 3] >> 4 != 0;
    for (std::size_t i = 0; i < components; ++i) {
      const int dc = segment[2 * i + 2] >> 4, ac = segment[2 * i + 2] & 15;
      if (dc > 3 || ac > 3) return false;
      // Refinement of DC coefficients uses no Huffman table.
      if (first == 0 && !refines && !defined_[0][dc]) return false;
      if (last > 0 && !defined_[1][ac]) return false;
    }
    return true;
  }

 private:
  bool defined_[2][4]{};
};

/// Counts the components of the picture that a scan has had.
class Components {
 public:
  /// Reads a SOF segment.
  void announce(Bytes segment) { count_ = segment.size() > 5 ? segment[5] : 0; }
  /// Reads a valid SOS segment.
  void add(Bytes segment) {
    for (std::size_t i = 0; i < segment[0]; ++i) seen_.set(segment[2 * i + 1]);
  }
  bool all_seen() const { return count_ > 0 && seen_.count() >= count_; }

 private:
  std::size_t count_ = 0;
  std::bitset<256> seen_;
};

}  // namespace

// Parses all segments instead of searching for the end marker, because thumbnails in EXIF segments contain end markers
// too.
JpegCheck check_jpeg(Bytes bytes) {
  constexpr const char* cut = "cut off before its end";
  HuffmanTables tables;
  Components components;
  bool progressive = false, in_scan = false;
  std::size_t position = 2;
  while (true) {
    while (position < bytes.size() && bytes[position] != 0xff) ++position;  // entropy-coded data, or padding
    while (position < bytes.size() && bytes[position] == 0xff) ++position;
    if (position >= bytes.size()) return {cut, in_scan && components.all_seen()};
    const std::uint8_t marker = bytes[position++];
    if (marker == 0xd9) return {};
    const bool without_content = marker == 0x00 || marker == 0x01 || (marker >= 0xd0 && marker <= 0xd8);
    if (without_content) continue;
    in_scan = marker == 0xda;
    if (bytes.size() - position < 2) return {cut};
    const std::size_t length = std::size_t(bytes[position]) << 8 | bytes[position + 1];
    if (length < 2) return {"has a segment of impossible length"};
    if (length > bytes.size() - position) return {cut};
    const Bytes content = bytes.subspan(position + 2, length - 2);
    progressive = progressive || marker == 0xc2;
    if (marker >= 0xc0 && marker <= 0xc2) components.announce(content);
    if (marker == 0xc4 && !tables.define(content)) return {"has an impossible Huffman table"};
    if (marker == 0xda && !tables.has_those_of(content, progressive)) return {"has a scan without its Huffman tables"};
    if (marker == 0xda) components.add(content);
    position += length;
  }
}

}  // namespace trisoup
