// encode_png() and write_png().
#include <zlib.h>

#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <string_view>

#include "base/atomic_file.h"
#include "base/error.h"
#include "base/printable.h"
#include "base/read_file.h"
#include "image/image_file.h"
#include "image/palette.h"

namespace trisoup {
namespace {

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
  std::string file("\x89PNG\r\n\x1a\n", 8);
  append_chunk(file, "IHDR", header);
  file += chunks;
  append_chunk(file, "IDAT", content);
  append_chunk(file, "IEND", {});
  return file;
}

}  // namespace

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
