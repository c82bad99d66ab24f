#include "image/image_file.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>

#include "atomic_file.h"
#include "error.h"
#include "printable.h"
#include "read_file.h"

// The decoder is private to this file: other libraries in the program bring their own copy under the same names. Memory is
// cleared for it, because it reads tables that a damaged JPEG never sets.
#define STBI_MALLOC(size) std::calloc(1, size)
#define STBI_REALLOC(pointer, size) std::realloc(pointer, size)
#define STBI_FREE(pointer) std::free(pointer)
#define STBI_ASSERT(condition) ((void)0)
#ifdef __clang__  // its arithmetic on damaged data overflows and shifts too far, without harm
#pragma clang attribute push(__attribute__((no_sanitize("shift", "signed-integer-overflow"))), apply_to = function)
#endif
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wsign-compare"
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"
#define STB_IMAGE_STATIC
#define STB_IMAGE_IMPLEMENTATION
#define STBI_ONLY_PNG
#define STBI_ONLY_JPEG
#define STBI_NO_LINEAR
#include <stb/stb_image.h>
#pragma GCC diagnostic pop
#ifdef __clang__
#pragma clang attribute pop
#endif

namespace trisoup {
namespace {

using Bytes = std::span<const std::uint8_t>;

constexpr std::array<std::uint8_t, 8> png_signature{0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};

bool is_png(Bytes bytes) {
  return bytes.size() >= png_signature.size() && std::equal(png_signature.begin(), png_signature.end(), bytes.begin());
}

std::uint32_t big_endian_32(const std::uint8_t* p) {
  return std::uint32_t(p[0]) << 24 | std::uint32_t(p[1]) << 16 | std::uint32_t(p[2]) << 8 | p[3];
}

// stb_image checks neither the checksums nor that the last chunk is there.
const char* png_damage(Bytes bytes) {
  std::size_t position = png_signature.size();
  while (bytes.size() - position >= 12) {
    const std::uint8_t* chunk = bytes.data() + position;
    const std::uint32_t length = big_endian_32(chunk);
    if (length > bytes.size() - position - 12) return "is cut in the middle of a chunk";
    if (crc32(crc32(0, nullptr, 0), chunk + 4, length + 4) != big_endian_32(chunk + 8 + length)) return "has a wrong checksum";
    if (std::memcmp(chunk + 4, "IEND", 4) == 0) return nullptr;
    position += length + 12;
  }
  return "is cut before its end";
}

// The Huffman tables that a JPEG has defined so far, by class (0: DC, 1: AC) and number. stb_image neither checks that a
// table has at most 256 codes, and writes past its own if one has more, nor that a scan's tables are there.
class HuffmanTables {
 public:
  /// Reads a DHT segment; false if it is malformed.
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

  /// Reads a SOS segment; false if it is malformed or names a table that is not there.
  bool has_those_of(Bytes segment, bool progressive) const {
    const std::size_t components = segment.empty() ? 0 : segment[0];
    if (components < 1 || components > 4 || segment.size() != 4 + 2 * components) return false;
    // A baseline scan holds all coefficients, whatever it says.
    const int first = progressive ? segment[2 * components + 1] : 0, last = progressive ? segment[2 * components + 2] : 63;
    const bool refines = progressive && segment[2 * components + 3] >> 4 != 0;
    for (std::size_t i = 0; i < components; ++i) {
      const int dc = segment[2 * i + 2] >> 4, ac = segment[2 * i + 2] & 15;
      if (dc > 3 || ac > 3) return false;
      // Refining the DC coefficients takes plain bits.
      if (first == 0 && !refines && !defined_[0][dc]) return false;
      if (last > 0 && !defined_[1][ac]) return false;
    }
    return true;
  }

 private:
  bool defined_[2][4]{};
};

// stb_image fills what is missing of a cut JPEG with grey. Segments are walked rather than searched for the end marker,
// because thumbnails inside EXIF segments carry end markers of their own.
const char* jpeg_damage(Bytes bytes) {
  constexpr const char* cut = "is cut before its end";
  HuffmanTables tables;
  bool progressive = false;
  std::size_t position = 2;
  while (true) {
    while (position < bytes.size() && bytes[position] != 0xff) ++position;  // entropy-coded data, or padding
    while (position < bytes.size() && bytes[position] == 0xff) ++position;
    if (position >= bytes.size()) return cut;
    const std::uint8_t marker = bytes[position++];
    if (marker == 0xd9) return nullptr;
    const bool without_content = marker == 0x00 || marker == 0x01 || (marker >= 0xd0 && marker <= 0xd8);
    if (without_content) continue;
    if (bytes.size() - position < 2) return cut;
    const std::size_t length = std::size_t(bytes[position]) << 8 | bytes[position + 1];
    if (length < 2) return "has a segment of impossible length";
    if (length > bytes.size() - position) return cut;
    const Bytes content = bytes.subspan(position + 2, length - 2);
    progressive = progressive || marker == 0xc2;
    if (marker == 0xc4 && !tables.define(content)) return "has an impossible Huffman table";
    if (marker == 0xda && !tables.has_those_of(content, progressive)) return "has a scan without its Huffman tables";
    position += length;
  }
}

// A header may claim any size. No PNG or JPEG packs more than about 8300 pixels into a byte, and no photograph of a scene
// is larger than 2^28 pixels; both are checked before memory is allocated for them.
void check_size(const std::string& name, int width, int height, std::uintmax_t bytes) {
  const auto pixels = std::uintmax_t(width) * std::uintmax_t(height);
  if (width < 1 || height < 1 || pixels > (std::uintmax_t(1) << 28) || pixels / 10000 > bytes)
    throw Error("{}: claims {} x {} pixels in {} bytes; the image is damaged or too large, export it again", name, width, height,
                bytes);
}

void append_chunk(std::string& file, const char* type, std::string_view content) {
  const auto put = [&](std::uint32_t value) {
    for (int shift = 24; shift >= 0; shift -= 8) file.push_back(static_cast<char>(value >> shift));
  };
  put(static_cast<std::uint32_t>(content.size()));
  const std::size_t start = file.size();
  file.append(type, 4).append(content);
  put(static_cast<std::uint32_t>(
      crc32(crc32(0, nullptr, 0), reinterpret_cast<const Bytef*>(file.data() + start), static_cast<uInt>(file.size() - start))));
}

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, CloseFile>;

}  // namespace

bool is_jpeg(std::span<const std::byte> bytes) {
  return bytes.size() >= 3 && bytes[0] == std::byte{0xff} && bytes[1] == std::byte{0xd8} && bytes[2] == std::byte{0xff};
}

ImageSize image_size(const std::filesystem::path& path) {
  const std::string name = printable(path.string());
  const File file(std::fopen(path.c_str(), "rb"));
  if (!file) throw Error("{}: cannot be opened ({}); check its permissions", name, std::strerror(errno));
  ImageSize size;
  int channels = 0;
  if (stbi_info_from_file(file.get(), &size.width, &size.height, &channels) == 0)
    throw Error("{}: its header is damaged, not that of a PNG or JPEG, or of an image too large ({}); convert or copy the image again",
                name, stbi_failure_reason());
  std::error_code problem;
  check_size(name, size.width, size.height, std::filesystem::file_size(path, problem));
  return size;
}

Image decode_image(std::span<const std::byte> content, const std::string& name) {
  const Bytes bytes(reinterpret_cast<const std::uint8_t*>(content.data()), content.size());
  if (!is_png(bytes) && !is_jpeg(content)) throw Error("{}: neither PNG nor JPEG; convert the image to one of them", name);
  if (bytes.size() > (std::size_t(1) << 30)) throw Error("{}: larger than 1 GiB; export the image at a smaller size", name);
  if (const char* damage = is_png(bytes) ? png_damage(bytes) : jpeg_damage(bytes))
    throw Error("{}: {}; copy or export the image again", name, damage);

  Image image;
  int channels = 0;
  const int size = static_cast<int>(bytes.size());
  if (stbi_info_from_memory(bytes.data(), size, &image.width, &image.height, &channels) == 0)
    throw Error("{}: header cannot be read ({}); export the image again", name, stbi_failure_reason());
  check_size(name, image.width, image.height, bytes.size());
  const std::unique_ptr<stbi_uc, decltype(&std::free)> pixels(
      stbi_load_from_memory(bytes.data(), size, &image.width, &image.height, &channels, 4), &std::free);
  if (!pixels) throw Error("{}: cannot be decoded ({}); export the image again", name, stbi_failure_reason());
  image.rgba.assign(pixels.get(), pixels.get() + std::size_t(image.width) * std::size_t(image.height) * 4);
  return image;
}

Image read_image(const std::filesystem::path& path) {
  const std::string content = read_file(path);
  return decode_image(bytes_of(content), printable(path.string()));
}

std::string encode_png(const Image& image, const std::string& name) {
  bool opaque = true;
  for (std::size_t i = 3; i < image.rgba.size() && opaque; i += 4) opaque = image.rgba[i] == 255;
  const std::size_t channels = opaque ? 3 : 4, row_bytes = std::size_t(image.width) * channels;

  // Every row is stored as differences to the one above (filter 2): half the size of plain rows for renders, one pass.
  std::string rows;
  rows.reserve((row_bytes + 1) * std::size_t(image.height));
  std::string above(row_bytes, '\0'), row(row_bytes, '\0');
  for (int y = 0; y < image.height; ++y) {
    const std::uint8_t* pixels = image.rgba.data() + std::size_t(y) * std::size_t(image.width) * 4;
    for (std::size_t x = 0; x < std::size_t(image.width); ++x) std::memcpy(&row[x * channels], pixels + x * 4, channels);
    rows.push_back(2);
    for (std::size_t i = 0; i < row_bytes; ++i) rows.push_back(static_cast<char>(row[i] - above[i]));
    above.swap(row);
  }
  uLongf packed_size = compressBound(rows.size());
  std::string packed(packed_size, '\0');
  if (compress2(reinterpret_cast<Bytef*>(packed.data()), &packed_size, reinterpret_cast<const Bytef*>(rows.data()), rows.size(),
                Z_DEFAULT_COMPRESSION) != Z_OK)
    throw Error("{}: the image cannot be compressed; free some memory", name);
  packed.resize(packed_size);

  std::string header;
  for (const std::uint32_t side : {std::uint32_t(image.width), std::uint32_t(image.height)})
    for (int shift = 24; shift >= 0; shift -= 8) header.push_back(static_cast<char>(side >> shift));
  header += {8, static_cast<char>(opaque ? 2 : 6), 0, 0, 0};
  std::string file(reinterpret_cast<const char*>(png_signature.data()), png_signature.size());
  append_chunk(file, "IHDR", header);
  append_chunk(file, "IDAT", packed);
  append_chunk(file, "IEND", {});
  return file;
}

void write_png(const std::filesystem::path& path, const Image& image) {
  const std::string name = printable(path.string());
  if (image.width < 1 || image.height < 1 || image.rgba.size() != std::size_t(image.width) * std::size_t(image.height) * 4)
    throw Error("{}: an image of {} x {} pixels cannot be written; give it its pixels first", name, image.width, image.height);
  const std::string content = encode_png(image, name);
  write_file_atomically(path, bytes_of(content));
}

}  // namespace trisoup
