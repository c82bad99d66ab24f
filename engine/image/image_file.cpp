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

#include "base/atomic_file.h"
#include "base/error.h"
#include "base/printable.h"
#include "base/read_file.h"
#include "image/jpeg_header.h"
#include "image/jpeg_reduced.h"
#include "image/palette.h"
#include "image/webp_tiff.h"

// stb_image is static in this file because other libraries in the program contain copies with the same names. Its
// memory is zeroed because it reads tables that a damaged JPEG never sets.
#define STBI_MALLOC(size) std::calloc(1, size)
#define STBI_REALLOC(pointer, size) std::realloc(pointer, size)
#define STBI_FREE(pointer) std::free(pointer)
#define STBI_ASSERT(condition) ((void)0)
#ifdef __clang__  // stb_image overflows and shifts too far on damaged data, without harm
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

// Returns what is wrong with a PNG, or null. stb_image checks neither the checksums nor the presence of the last chunk.
const char* png_damage(Bytes bytes) {
  std::size_t position = png_signature.size();
  while (bytes.size() - position >= 12) {
    const std::uint8_t* chunk = bytes.data() + position;
    const std::uint32_t length = big_endian_32(chunk);
    if (length > bytes.size() - position - 12) return "cut off in the middle of a chunk";
    if (crc32(crc32(0, nullptr, 0), chunk + 4, length + 4) != big_endian_32(chunk + 8 + length))
      return "has a wrong checksum";
    if (std::memcmp(chunk + 4, "IEND", 4) == 0) return nullptr;
    position += length + 12;
  }
  return "cut off before its end";
}

// The Huffman tables defined so far in a JPEG, by class (0: DC, 1: AC) and number. These checks are needed because
// stb_image does not make them: a table with more than 256 codes makes it write out of bounds, and a scan may use
// tables that were never defined.
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

// Returns what is wrong with a JPEG, or null. stb_image fills missing parts of a truncated JPEG with grey. The function
// parses all segments instead of searching for the end marker, because thumbnails in EXIF segments contain end markers
// too.
const char* jpeg_damage(Bytes bytes) {
  constexpr const char* cut = "cut off before its end";
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

// Limits that are checked before memory is allocated, because a damaged header may claim any size. PNG and JPEG store
// at most about 8300 pixels per byte; WebP stores more if all have one colour. No photograph of a scene has more than
// 2^28 pixels.
constexpr std::uintmax_t kMostPixels = std::uintmax_t(1) << 28, kMostPerByte = 10000, kMostPerByteOfWebp = 1 << 20;

void check_size(const std::string& name, std::int64_t width, std::int64_t height, std::uintmax_t bytes,
                std::uintmax_t per_byte = kMostPerByte) {
  const auto pixels = std::uintmax_t(width) * std::uintmax_t(height);
  if (width > 0 && height > 0 && pixels > kMostPixels)
    throw Error("{}: {} x {} pixels exceed the limit of {:.0f} million (2^28); export the image at a smaller size",
                name, width, height, double(kMostPixels) / 1e6);
  if (width < 1 || height < 1 || pixels / per_byte > bytes)
    throw Error("{}: claims {} x {} pixels in {} bytes; the image is damaged or too large, export it again", name,
                width, height, bytes);
}

void append_chunk(std::string& file, const char* type, std::string_view content) {
  const auto put = [&](std::uint32_t value) {
    for (int shift = 24; shift >= 0; shift -= 8) file.push_back(static_cast<char>(value >> shift));
  };
  put(static_cast<std::uint32_t>(content.size()));
  const std::size_t start = file.size();
  file.append(type, 4).append(content);
  put(static_cast<std::uint32_t>(crc32(crc32(0, nullptr, 0), reinterpret_cast<const Bytef*>(file.data() + start),
                                       static_cast<uInt>(file.size() - start))));
}

/// Compresses `rows` to the content of an IDAT chunk.
std::string packed(const std::string& rows, int strategy, int level, const std::string& name) {
  z_stream stream{};
  if (deflateInit2(&stream, level, Z_DEFLATED, MAX_WBITS, 8, strategy) != Z_OK)
    throw Error("{}: the image cannot be compressed; free some memory", name);
  std::string result(deflateBound(&stream, rows.size()), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(rows.data()));
  stream.avail_in = static_cast<uInt>(rows.size());
  stream.next_out = reinterpret_cast<Bytef*>(result.data());
  stream.avail_out = static_cast<uInt>(result.size());
  const int status = deflate(&stream, Z_FINISH);
  deflateEnd(&stream);
  if (status != Z_STREAM_END) throw Error("{}: the image cannot be compressed; free some memory", name);
  result.resize(stream.total_out);
  return result;
}

/// kind: PNG colour type. chunks: chunks between IHDR and IDAT.
std::string png_file(int width, int height, char kind, const std::string& chunks, const std::string& content) {
  std::string header;
  for (const std::uint32_t side : {std::uint32_t(width), std::uint32_t(height)})
    for (int shift = 24; shift >= 0; shift -= 8) header.push_back(static_cast<char>(side >> shift));
  header += {8, kind, 0, 0, 0};
  std::string file(reinterpret_cast<const char*>(png_signature.data()), png_signature.size());
  append_chunk(file, "IHDR", header);
  file += chunks;
  append_chunk(file, "IDAT", content);
  append_chunk(file, "IEND", {});
  return file;
}

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, CloseFile>;

}  // namespace

bool is_jpeg(std::span<const std::byte> bytes) {
  return bytes.size() >= 3 && bytes[0] == std::byte{0xff} && bytes[1] == std::byte{0xd8} && bytes[2] == std::byte{0xff};
}

Image turned(Image image, int orientation) {
  if (orientation <= 1 || orientation > 8) return image;
  const int w = image.width, h = image.height;
  const bool exchange = orientation >= 5;
  Image result{exchange ? h : w, exchange ? w : h, std::vector<std::uint8_t>(image.rgba.size())};
  for (int y = 0; y < result.height; ++y)
    for (int x = 0; x < result.width; ++x) {
      // Position of the pixel in the file. 5 to 8 exchange rows and columns.
      int from_x = exchange ? y : x, from_y = exchange ? x : y;
      if (orientation == 2 || orientation == 3 || orientation == 7 || orientation == 8) from_x = w - 1 - from_x;
      if (orientation == 3 || orientation == 4 || orientation == 6 || orientation == 7) from_y = h - 1 - from_y;
      std::memcpy(&result.rgba[4 * (std::size_t(y) * std::size_t(result.width) + std::size_t(x))],
                  &image.rgba[4 * (std::size_t(from_y) * std::size_t(w) + std::size_t(from_x))], 4);
    }
  return result;
}

ImageSize image_size(const std::filesystem::path& path) {
  const std::string name = printable(path.string());
  const File file(std::fopen(path.c_str(), "rb"));
  if (!file) throw Error("{}: cannot be opened ({}); check its permissions", name, std::strerror(errno));
  std::error_code problem;
  const std::uintmax_t bytes = std::filesystem::file_size(path, problem);
  // EXIF data and thumbnails, in segments of up to 64 KiB, precede the size in a JPEG.
  std::vector<std::uint8_t> head(std::size_t(1) << 18);
  head.resize(std::fread(head.data(), 1, head.size(), file.get()));
  const Bytes start(head);
  ImageSize size;
  if (is_webp(std::as_bytes(start))) {
    size = webp_size(std::as_bytes(start), name);
    check_size(name, size.width, size.height, bytes, kMostPerByteOfWebp);
    return size;
  }
  if (is_tiff(std::as_bytes(start))) {
    const std::string content = read_file(path);  // the directory may be at the end of the file
    size = tiff_size(bytes_of(content), name);
    check_size(name, size.width, size.height, bytes);
    return size;
  }
  // Checks sizes that stb_image cannot represent.
  if (is_png(start) && start.size() >= 24)
    check_size(name, big_endian_32(&start[16]), big_endian_32(&start[20]), bytes);
  if (is_jpeg(std::as_bytes(start))) {
    const JpegHeader header = jpeg_header(start);
    size.orientation = header.orientation;
    if (header.width > 0 && header.height > 0) check_size(name, header.width, header.height, bytes);
  }
  std::rewind(file.get());
  int channels = 0;
  if (stbi_info_from_file(file.get(), &size.width, &size.height, &channels) == 0)
    throw Error("{}: not a PNG, JPEG, WebP or TIFF, or its header is damaged ({}); convert or copy the image again",
                name, stbi_failure_reason());
  check_size(name, size.width, size.height, bytes);
  return size;
}

Image decode_image(std::span<const std::byte> content, const std::string& name, int divisor) {
  const Bytes bytes(reinterpret_cast<const std::uint8_t*>(content.data()), content.size());
  if (bytes.size() > (std::size_t(1) << 30))
    throw Error("{}: larger than 1 GiB; export the image at a smaller size", name);
  if (is_webp(content))
    return decode_webp(content, name, [&](ImageSize size) {
      check_size(name, size.width, size.height, bytes.size(), kMostPerByteOfWebp);
    });
  if (is_tiff(content))
    return decode_tiff(content, name, [&](ImageSize size) { check_size(name, size.width, size.height, bytes.size()); });
  if (!is_png(bytes) && !is_jpeg(content))
    throw Error("{}: neither PNG, JPEG, WebP nor TIFF; convert the image to one of them", name);
  if (is_png(bytes) && bytes.size() >= 24)
    check_size(name, big_endian_32(&bytes[16]), big_endian_32(&bytes[20]), bytes.size());
  if (const char* damage = is_png(bytes) ? png_damage(bytes) : jpeg_damage(bytes))
    throw Error("{}: {}; copy or export the image again", name, damage);

  Image image;
  int channels = 0;
  const int size = static_cast<int>(bytes.size());
  if (stbi_info_from_memory(bytes.data(), size, &image.width, &image.height, &channels) == 0)
    throw Error("{}: the header cannot be read ({}); export the image again", name, stbi_failure_reason());
  check_size(name, image.width, image.height, bytes.size());
  if (divisor > 1 && is_jpeg(content))
    if (auto reduced = decode_jpeg_reduced(content, name, divisor)) return std::move(*reduced);
  const std::unique_ptr<stbi_uc, decltype(&std::free)> pixels(
      stbi_load_from_memory(bytes.data(), size, &image.width, &image.height, &channels, 4), &std::free);
  if (!pixels) throw Error("{}: cannot be decoded ({}); export the image again", name, stbi_failure_reason());
  image.rgba.assign(pixels.get(), pixels.get() + std::size_t(image.width) * std::size_t(image.height) * 4);
  return image;
}

Image read_image(const std::filesystem::path& path, int divisor) {
  const std::string content = read_file(path);
  return decode_image(bytes_of(content), printable(path.string()), divisor);
}

std::string encode_png(const Image& image, const std::string& name) {
  bool opaque = true;
  for (std::size_t i = 3; i < image.rgba.size() && opaque; i += 4) opaque = image.rgba[i] == 255;
  const std::size_t channels = opaque ? 3 : 4, row_bytes = std::size_t(image.width) * channels;

  // Stores every row as differences to the row above (filter 2), which halves the size of renders and needs one pass.
  std::string rows;
  rows.reserve((row_bytes + 1) * std::size_t(image.height));
  std::string above(row_bytes, '\0'), row(row_bytes, '\0');
  for (int y = 0; y < image.height; ++y) {
    const std::uint8_t* pixels = image.rgba.data() + std::size_t(y) * std::size_t(image.width) * 4;
    for (std::size_t x = 0; x < std::size_t(image.width); ++x)
      std::memcpy(&row[x * channels], pixels + x * 4, channels);
    rows.push_back(2);
    for (std::size_t i = 0; i < row_bytes; ++i) rows.push_back(static_cast<char>(row[i] - above[i]));
    above.swap(row);
  }
  return png_file(image.width, image.height, opaque ? 2 : 6, "",
                  packed(rows, Z_DEFAULT_STRATEGY, Z_DEFAULT_COMPRESSION, name));
}

std::string encode_png(const PaletteImage& image, const std::string& name) {
  const std::size_t width = static_cast<std::size_t>(image.width), height = static_cast<std::size_t>(image.height);
  // Compresses plain rows and rows with the Paeth predictor (filter 4), and keeps the smaller result.
  std::string plain, predicted;
  const auto pixel = [&](std::size_t x, std::size_t y) { return image.pixels[y * width + x]; };
  for (std::size_t y = 0; y < height; ++y) {
    plain.push_back(0);
    predicted.push_back(4);
    for (std::size_t x = 0; x < width; ++x) {
      const int left = x > 0 ? pixel(x - 1, y) : 0, above = y > 0 ? pixel(x, y - 1) : 0,
                both = x > 0 && y > 0 ? pixel(x - 1, y - 1) : 0;
      const int from_left = std::abs(above - both), from_above = std::abs(left - both),
                from_both = std::abs(left + above - 2 * both);
      const int guess = from_left <= from_above && from_left <= from_both ? left
                        : from_above <= from_both                         ? above
                                                                          : both;
      plain.push_back(static_cast<char>(pixel(x, y)));
      predicted.push_back(static_cast<char>(pixel(x, y) - guess));
    }
  }
  std::string content = packed(plain, Z_DEFAULT_STRATEGY, Z_BEST_COMPRESSION, name);
  if (std::string other = packed(predicted, Z_FILTERED, Z_BEST_COMPRESSION, name); other.size() < content.size())
    content.swap(other);
  std::string colours, alphas, chunks;
  for (const glm::u8vec4& c : image.colours) {
    for (int i = 0; i < 3; ++i) colours.push_back(static_cast<char>(c[i]));
    if (c.a != 255) alphas.push_back(static_cast<char>(c.a));  // colours with alpha 0 come first; all others have 255
  }
  append_chunk(chunks, "PLTE", colours);
  if (!alphas.empty()) append_chunk(chunks, "tRNS", alphas);
  return png_file(image.width, image.height, 3, chunks, content);
}

void write_png(const std::filesystem::path& path, const Image& image) {
  const std::string name = printable(path.string());
  if (image.width < 1 || image.height < 1 ||
      image.rgba.size() != std::size_t(image.width) * std::size_t(image.height) * 4)
    throw Error("{}: the image data do not match its size of {} x {} pixels; report this as a bug", name, image.width,
                image.height);
  const std::string content = encode_png(image, name);
  write_file_atomically(path, bytes_of(content));
}

}  // namespace trisoup
