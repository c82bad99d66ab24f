#include "image/jpeg_header.h"

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <map>
#include <string_view>

namespace trisoup {
namespace {

using Bytes = std::span<const std::uint8_t>;

/// Parts of an ICC profile, by number from 1.
class IccParts {
 public:
  /// Adds the content of an APP2 segment if it is a part of a profile.
  void add(Bytes segment) {
    constexpr std::string_view kMark("ICC_PROFILE\0", 12);
    if (segment.size() < kMark.size() + 2 || std::memcmp(segment.data(), kMark.data(), kMark.size()) != 0) return;
    const Bytes part = segment.subspan(kMark.size() + 2);
    count_ = segment[kMark.size() + 1];
    parts_.emplace(segment[kMark.size()], std::string(part.begin(), part.end()));
  }

  void join(JpegHeader& header) const {
    std::string whole;
    for (int number = 1; number <= count_; ++number) {
      const auto part = parts_.find(number);
      if (part == parts_.end()) {
        header.icc_incomplete = true;
        return;
      }
      whole += part->second;
    }
    header.icc = std::move(whole);
  }

 private:
  std::map<int, std::string> parts_;
  int count_ = 0;
};

}  // namespace

JpegHeader jpeg_header(Bytes bytes) {
  JpegHeader header;
  IccParts icc;
  bool has_exif = false;
  std::size_t position = 2;
  while (position + 4 <= bytes.size() && bytes[position] == 0xff) {
    const std::uint8_t marker = bytes[position + 1];
    if (marker == 0xff) {  // padding
      ++position;
      continue;
    }
    const std::size_t length = std::size_t(bytes[position + 2]) << 8 | bytes[position + 3];
    if (length < 2 || marker == 0xd9 || marker == 0xda) break;
    const Bytes content = bytes.subspan(position + 4, std::min(length - 2, bytes.size() - position - 4));
    const bool exif = content.size() > 6 && std::memcmp(content.data(), "Exif\0\0", 6) == 0;
    if (marker == 0xe1 && exif && !has_exif) {
      header.exif = read_exif(content);
      has_exif = true;
    }
    if (marker == 0xe2) icc.add(content);
    // SOF0 to SOF15, except three markers of other segments (DHT, JPG, DAC).
    const bool frame = marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
    if (frame && content.size() >= 5 && header.width == 0) {
      header.height = content[1] << 8 | content[2];
      header.width = content[3] << 8 | content[4];
    }
    position += 2 + length;
  }
  icc.join(header);
  return header;
}

}  // namespace trisoup
