#include "image/tiff_directory.h"

#include <algorithm>
#include <cstddef>
#include <cstring>

namespace trisoup {
namespace {

constexpr std::size_t kEntryBytes = 12;
constexpr std::uint32_t kShort = 3, kLong = 4;

}  // namespace

TiffDirectory::TiffDirectory(std::span<const std::uint8_t> tiff) : tiff_(tiff) {
  if (tiff.size() < 8) return;
  little_ = tiff[0] == 'I';
  if (tiff[0] != tiff[1] || (tiff[0] != 'I' && tiff[0] != 'M') || number(2, 2) != 42) return;
  const std::size_t directory = number(4, 4);
  if (directory > tiff.size() - 2) return;
  first_ = directory + 2;
  count_ = std::min<std::size_t>(number(directory, 2), (tiff.size() - first_) / kEntryBytes);
}

std::uint32_t TiffDirectory::number(std::size_t at, std::size_t bytes) const {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < bytes; ++i) value |= std::uint32_t(tiff_[at + i]) << 8 * (little_ ? i : bytes - 1 - i);
  return value;
}

std::size_t TiffDirectory::entry(std::uint16_t tag) const {
  for (std::size_t i = 0; i < count_; ++i)
    if (number(first_ + kEntryBytes * i, 2) == tag) return first_ + kEntryBytes * i;
  return 0;
}

bool TiffDirectory::has(std::uint16_t tag) const { return entry(tag) != 0; }

std::optional<std::uint32_t> TiffDirectory::value(std::uint16_t tag) const {
  const std::size_t at = entry(tag);
  if (at == 0 || number(at + 4, 4) != 1) return std::nullopt;
  const std::uint32_t type = number(at + 2, 2);
  if (type == kShort) return number(at + 8, 2);
  if (type == kLong) return number(at + 8, 4);
  return std::nullopt;
}

int exif_orientation(std::span<const std::uint8_t> exif) {
  constexpr std::size_t kMark = 6;
  constexpr std::uint16_t kOrientation = 0x112;
  if (exif.size() > kMark && std::memcmp(exif.data(), "Exif\0\0", kMark) == 0) exif = exif.subspan(kMark);
  const std::uint32_t value = TiffDirectory(exif).value(kOrientation).value_or(1);
  return value >= 1 && value <= 8 ? static_cast<int>(value) : 1;
}

}  // namespace trisoup
