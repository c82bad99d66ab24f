#include "image/jpeg_header.h"

#include <algorithm>
#include <cstddef>
#include <cstring>

namespace trisoup {
namespace {

using Bytes = std::span<const std::uint8_t>;

/// Reads the orientation from an EXIF segment, a TIFF directory with entries of 12 bytes. Returns 1 if there is none.
int orientation_in(Bytes segment) {
  constexpr std::size_t kMark = 6, kEntry = 12;
  if (segment.size() < kMark + 8 || std::memcmp(segment.data(), "Exif\0\0", kMark) != 0) return 1;
  const Bytes tiff = segment.subspan(kMark);
  const bool little = tiff[0] == 'I';
  const auto number = [&](std::size_t at, std::size_t bytes) {
    std::size_t value = 0;
    for (std::size_t i = 0; i < bytes; ++i) value |= std::size_t(tiff[at + i]) << 8 * (little ? i : bytes - 1 - i);
    return value;
  };
  const std::size_t directory = number(4, 4);
  if (directory > tiff.size() - 2) return 1;
  const std::size_t entries = number(directory, 2);
  for (std::size_t i = 0; i < entries; ++i) {
    const std::size_t at = directory + 2 + kEntry * i;
    if (at + kEntry > tiff.size()) break;
    constexpr std::size_t kOrientation = 0x112, kShort = 3;
    if (number(at, 2) != kOrientation || number(at + 2, 2) != kShort) continue;
    const std::size_t value = number(at + 8, 2);
    return value >= 1 && value <= 8 ? static_cast<int>(value) : 1;
  }
  return 1;
}

}  // namespace

JpegHeader jpeg_header(Bytes bytes) {
  JpegHeader header;
  std::size_t position = 2;
  while (position + 4 <= bytes.size()) {
    if (bytes[position] != 0xff) return header;
    const std::uint8_t marker = bytes[position + 1];
    if (marker == 0xff) {  // padding
      ++position;
      continue;
    }
    const std::size_t length = std::size_t(bytes[position + 2]) << 8 | bytes[position + 3];
    if (length < 2 || marker == 0xd9 || marker == 0xda) return header;
    const Bytes content = bytes.subspan(position + 4, std::min(length - 2, bytes.size() - position - 4));
    if (marker == 0xe1 && header.orientation == 1) header.orientation = orientation_in(content);
    // SOF0 to SOF15, except three markers of other segments (DHT, JPG, DAC).
    const bool frame = marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
    if (frame && content.size() >= 5) {
      header.height = content[1] << 8 | content[2];
      header.width = content[3] << 8 | content[4];
      return header;
    }
    position += 2 + length;
  }
  return header;
}

}  // namespace trisoup
