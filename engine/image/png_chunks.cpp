#include "image/png_chunks.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <optional>
#include <string_view>

#include "image/tiff_directory.h"

namespace trisoup {
namespace {

constexpr std::size_t kSignature = 8, kAround = 12;  // bytes of a chunk beside its content
// No profile or EXIF data of a photograph is larger, packed or not.
constexpr std::size_t kMostMetadata = std::size_t(1) << 24;

std::uint32_t png_number(std::string_view bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) value = value << 8 | static_cast<unsigned char>(bytes[at + i]);
  return value;
}

/// Unpacks a zlib stream. Returns nothing if it is damaged or too large.
std::optional<std::string> unpacked(std::string_view content) {
  z_stream stream{};
  if (inflateInit(&stream) != Z_OK) return std::nullopt;
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(content.data()));
  stream.avail_in = static_cast<uInt>(content.size());
  std::string result;
  int status = Z_OK;
  while (status == Z_OK && result.size() < kMostMetadata) {
    std::array<char, 4096> part;
    stream.next_out = reinterpret_cast<Bytef*>(part.data());
    stream.avail_out = part.size();
    status = inflate(&stream, Z_NO_FLUSH);
    result.append(part.data(), part.size() - stream.avail_out);
  }
  inflateEnd(&stream);
  if (status != Z_STREAM_END) return std::nullopt;
  return result;
}

/// Text of a tEXt or zTXt chunk with this keyword, unpacked.
std::optional<std::string> text_of_chunk(std::string_view type, std::string_view content, std::string_view keyword) {
  if (!content.starts_with(keyword) || content.size() < keyword.size() + 2 || content[keyword.size()] != '\0')
    return std::nullopt;
  content.remove_prefix(keyword.size() + 1);
  if (type == "tEXt") return std::string(content);
  content.remove_prefix(1);  // method of compression, always zlib
  return unpacked(content);
}

/// Bytes of the hexadecimal text "\nexif\n   length\n4578..." that ImageMagick writes.
std::string bytes_of_hex(std::string_view text) {
  for (int line = 0; line < 3; ++line) {
    const std::size_t end = text.find('\n');
    if (end == std::string_view::npos) return {};
    text.remove_prefix(end + 1);
  }
  std::string bytes;
  int digits = 0, value = 0;
  for (const char c : text) {
    const auto at = std::string_view("0123456789abcdefABCDEF").find(c);
    if (at == std::string_view::npos) continue;
    value = value << 4 | static_cast<int>(at < 16 ? at : at - 6);
    if (++digits % 2 != 0) continue;
    bytes.push_back(static_cast<char>(value));
    value = 0;
  }
  return bytes;
}

/// EXIF data of a chunk, or nothing.
std::string exif_of_chunk(std::string_view type, std::string_view content) {
  if (type == "eXIf") return std::string(content);
  for (const char* keyword : {"Raw profile type exif", "Raw profile type APP1"})
    if (const auto text = text_of_chunk(type, content, keyword)) return bytes_of_hex(*text);
  return {};
}

/// Calls `visit` with type and content of each chunk of a whole PNG before the first IDAT.
template <typename Visit>
void before_pixels(std::string_view png, const Visit& visit) {
  for (std::size_t at = kSignature; at < png.size() && png.size() - at >= kAround;) {
    const std::uint32_t length = png_number(png, at);
    const std::string_view type = png.substr(at + 4, 4);
    if (type == "IDAT" || length > png.size() - at - kAround) return;
    visit(type, png.substr(at + 8, length));
    at += kAround + length;
  }
}

/// Colours of gAMA and cHRM, or empty if they are those of sRGB.
ColourSpace of_numbers(std::string_view gamma, std::string_view chromaticities) {
  constexpr double kUnit = 100000, kSrgbGamma = 2.2, kSameGamma = 0.05, kSameChromaticity = 0.005;
  ColourSpace colours;
  if (gamma.size() == 4 && png_number(gamma, 0) > 0) {
    const double exponent = kUnit / png_number(gamma, 0);
    if (std::abs(exponent / kSrgbGamma - 1) > kSameGamma && exponent > 0.1 && exponent < 10) colours.gamma = exponent;
  }
  if (chromaticities.size() == 32) {
    constexpr std::array<double, 8> srgb{0.3127, 0.3290, 0.64, 0.33, 0.30, 0.60, 0.15, 0.06};
    std::array<double, 8> values{};
    bool same = true, possible = true;
    for (std::size_t i = 0; i < 8; ++i) {
      values[i] = png_number(chromaticities, 4 * i) / kUnit;
      same = same && std::abs(values[i] - srgb[i]) < kSameChromaticity;
      // Zero in y would be an infinite colour; wide spaces have blue slightly outside of the visible.
      possible = possible && values[i] < 1.2 && (i % 2 == 0 || values[i] > 1e-4);
    }
    if (!same && possible) colours.chromaticities = values;
  }
  return colours;
}

}  // namespace

const char* png_damage(std::span<const std::uint8_t> png) {
  const std::string_view bytes(reinterpret_cast<const char*>(png.data()), png.size());
  std::size_t position = kSignature;
  while (bytes.size() - position >= kAround) {
    const std::uint32_t length = png_number(bytes, position);
    if (length > bytes.size() - position - kAround) return "cut off in the middle of a chunk";
    if (crc32(crc32(0, nullptr, 0), png.data() + position + 4, length + 4) != png_number(bytes, position + 8 + length))
      return "has a wrong checksum";
    const std::string_view type = bytes.substr(position + 4, 4);
    if (type == "CgBI") return "is a PNG of an iOS app, which has other colours";
    if (type == "IEND") return nullptr;
    position += length + kAround;
  }
  return "cut off before its end";
}

int png_orientation(const ReadBytes& read) {
  for (std::uint64_t at = kSignature;;) {
    const std::string head = read(at, 8);
    if (head.size() < 8) return 1;
    const std::uint32_t length = png_number(head, 0);
    const std::string type = head.substr(4);
    if (type == "IEND") return 1;
    if ((type == "eXIf" || type == "tEXt" || type == "zTXt") && length <= kMostMetadata) {
      const std::string exif = exif_of_chunk(type, read(at + 8, length));
      const int orientation = read_exif({reinterpret_cast<const std::uint8_t*>(exif.data()), exif.size()}).orientation;
      if (orientation != 1) return orientation;
    }
    at += kAround + length;
  }
}

ColourSpace png_colours(std::span<const std::uint8_t> png, const std::string& name, std::vector<std::string>* notes) {
  std::string_view codes, profile, gamma, chromaticities;
  bool srgb = false;
  before_pixels({reinterpret_cast<const char*>(png.data()), png.size()},
                [&](std::string_view type, std::string_view content) {
                  if (type == "cICP") codes = content;
                  if (type == "iCCP") profile = content;
                  if (type == "gAMA") gamma = content;
                  if (type == "cHRM") chromaticities = content;
                  srgb = srgb || type == "sRGB";
                });
  if (codes.size() == 4)
    return colour_space_of_codes(static_cast<unsigned char>(codes[0]), static_cast<unsigned char>(codes[1]), name);
  if (!profile.empty()) {
    const std::size_t end = profile.find('\0');  // of the profile's name
    std::optional<std::string> icc;
    if (end != std::string_view::npos && profile.size() > end + 2) icc = unpacked(profile.substr(end + 2));
    if (!icc) add_note(notes, "have a damaged colour profile; their colours are used as stored");
    return {std::move(icc).value_or(std::string()), std::nullopt, std::nullopt};
  }
  if (srgb) return {};
  return of_numbers(gamma, chromaticities);
}

}  // namespace trisoup
