#include "image/tiff_directory.h"

#include <algorithm>
#include <cstring>

namespace trisoup {
namespace {

constexpr std::size_t kEntryBytes = 12;
constexpr std::uint32_t kAscii = 2, kShort = 3, kLong = 4, kRational = 5;

}  // namespace

TiffDirectory::TiffDirectory(std::span<const std::uint8_t> tiff, std::size_t position) : tiff_(tiff) {
  if (tiff.size() < 8) return;
  little_ = tiff[0] == 'I';
  if (tiff[0] != tiff[1] || (tiff[0] != 'I' && tiff[0] != 'M') || number(2, 2) != 42) return;
  if (position == 0) position = number(4, 4);
  if (position > tiff.size() - 2) return;
  first_ = position + 2;
  count_ = std::min<std::size_t>(number(position, 2), (tiff.size() - first_) / kEntryBytes);
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

std::optional<double> TiffDirectory::ratio(std::uint16_t tag) const {
  const std::size_t at = entry(tag);
  if (at == 0 || number(at + 2, 2) != kRational || number(at + 4, 4) != 1) return std::nullopt;
  const std::size_t place = number(at + 8, 4);
  if (place + 8 > tiff_.size()) return std::nullopt;
  const std::uint32_t denominator = number(place + 4, 4);
  if (denominator == 0) return std::nullopt;
  return double(number(place, 4)) / denominator;
}

std::string_view TiffDirectory::short_text(std::uint16_t tag) const {
  const std::size_t at = entry(tag);
  if (at == 0 || number(at + 2, 2) != kAscii) return {};
  const std::string_view text(reinterpret_cast<const char*>(&tiff_[at + 8]), std::min(number(at + 4, 4), 4u));
  return text.substr(0, text.find('\0'));
}

Exif read_exif(std::span<const std::uint8_t> bytes) {
  constexpr std::size_t kMark = 6;
  constexpr std::uint16_t kOrientation = 0x112, kExif = 0x8769, kFocalLength = 0x920a, kColourSpace = 0xa001,
                          kInteroperability = 0xa005, kIndex = 1;
  constexpr std::uint32_t kUncalibrated = 0xffff, kAdobeRgb = 2;  // 2 is not in the standard, but is written
  if (bytes.size() > kMark && std::memcmp(bytes.data(), "Exif\0\0", kMark) == 0) bytes = bytes.subspan(kMark);
  Exif exif;
  const TiffDirectory first(bytes);
  const std::uint32_t orientation = first.value(kOrientation).value_or(1);
  if (orientation >= 1 && orientation <= 8) exif.orientation = static_cast<int>(orientation);
  const std::uint32_t at = first.value(kExif).value_or(0);
  if (at == 0) return exif;
  const TiffDirectory details(bytes, at);
  exif.focal_length = details.ratio(kFocalLength).value_or(0);
  const std::uint32_t colours = details.value(kColourSpace).value_or(0),
                      interoperability = details.value(kInteroperability).value_or(0);
  // DCF 2.0 (CIPA DC-009): Adobe RGB is "uncalibrated" with the interoperability index R03.
  exif.adobe_rgb = colours == kAdobeRgb || (colours == kUncalibrated && interoperability != 0 &&
                                            TiffDirectory(bytes, interoperability).short_text(kIndex) == "R03");
  return exif;
}

}  // namespace trisoup
