#include "image/image_file.h"

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <memory>
#include <optional>

#include "base/error.h"
#include "base/printable.h"
#include "base/read_file.h"
#include "image/colour_profile.h"
#include "image/heif_file.h"
#include "image/jpeg_check.h"
#include "image/jpeg_header.h"
#include "image/jpeg_turbo.h"
#include "image/npy_file.h"
#include "image/picture_type.h"
#include "image/plain_formats.h"
#include "image/png_chunks.h"
#include "image/stb_decode.h"
#include "image/webp_tiff.h"

namespace trisoup {
namespace {

using Bytes = std::span<const std::uint8_t>;

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

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, CloseFile>;

Bytes unsigned_bytes(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()};
}

std::uint32_t big_endian_32(const std::uint8_t* p) {
  return std::uint32_t(p[0]) << 24 | std::uint32_t(p[1]) << 16 | std::uint32_t(p[2]) << 8 | p[3];
}

/// Returns the type of a file that has a decoder. Throws Error that names the type of others. start: the first bytes,
/// or the whole file. path: `name` may be cut.
PictureKind kind_of(std::span<const std::byte> start, const std::string& name, const std::filesystem::path& path) {
  const PictureType* type = picture_type(start, path);
  if (type != nullptr && !type->read) throw Error("{}: {} is not read; {}", name, type->name, type->remedy);
  if (picture_type(start) != nullptr) return type->kind;
  // TGA has no signature.
  const bool is_tga = examine_plain(PictureKind::tga, unsigned_bytes(start)).problem == nullptr;
  if (is_tga || (type != nullptr && type->kind == PictureKind::tga && !start.empty())) return PictureKind::tga;
  if (start.empty()) throw Error("{}: is empty; copy or export the image again", name);
  throw Error("{}: not a picture of a known type, or its header is damaged; convert or copy the image again", name);
}

/// Checks the size in the header of a PNG or JPEG, and returns it.
ImageSize png_or_jpeg_size(PictureKind kind, Bytes start, const std::string& name, std::uintmax_t bytes) {
  ImageSize size;
  // Checks sizes that stb_image cannot represent.
  if (kind == PictureKind::png && start.size() >= 24)
    check_size(name, big_endian_32(&start[16]), big_endian_32(&start[20]), bytes);
  if (kind == PictureKind::jpeg) {
    const JpegHeader header = jpeg_header(start);
    size.orientation = header.exif.orientation, size.focal_length = header.exif.focal_length;
    if (header.width > 0 && header.height > 0) check_size(name, header.width, header.height, bytes);
  }
  if (const char* reason = stb_size(start, size.width, size.height))
    throw Error("{}: its header is damaged or of a kind that is not read ({}); export the image again", name, reason);
  check_size(name, size.width, size.height, bytes);
  return size;
}

/// Checks a file of one of the plain formats, and returns what it says about itself.
PlainPicture checked_plain(PictureKind kind, Bytes bytes, const std::string& name) {
  PlainPicture picture = examine_plain(kind, bytes);
  if (picture.width > 0 && picture.height > 0) check_size(name, picture.width, picture.height, bytes.size());
  if (picture.problem != nullptr || picture.width < 1 || picture.height < 1)
    throw Error("{}: {}; export the image again, as PNG or JPEG", name,
                picture.problem != nullptr ? picture.problem : "has no pixels");
  return picture;
}

Image decode_plain(PictureKind kind, Bytes bytes, const std::string& name, ColourSpace& colours) {
  PlainPicture picture = checked_plain(kind, bytes, name);
  colours.icc = std::move(picture.icc);
  if (kind == PictureKind::pnm) return decode_pnm(bytes, name);
  Image image = stb_decode(bytes, name);
  if (picture.opaque)
    for (std::size_t i = 3; i < image.rgba.size(); i += 4) image.rgba[i] = 255;
  return image;
}

Image decode_png(Bytes bytes, const std::string& name, const DecodeOptions& options, ColourSpace& colours) {
  if (bytes.size() >= 24) check_size(name, big_endian_32(&bytes[16]), big_endian_32(&bytes[20]), bytes.size());
  if (const char* damage = png_damage(bytes)) throw Error("{}: {}; copy or export the image again", name, damage);
  png_or_jpeg_size(PictureKind::png, bytes, name, bytes.size());
  if (options.to_srgb) colours = png_colours(bytes, name, options.notes);
  return stb_decode(bytes, name);
}

Image decode_jpeg(std::span<const std::byte> content, const std::string& name, const DecodeOptions& options,
                  ColourSpace& colours) {
  std::string completed;
  const JpegCheck check = check_jpeg(unsigned_bytes(content));
  if (check.damage != nullptr && !check.lacks_end)
    throw Error("{}: {}; copy or export the image again", name, check.damage);
  png_or_jpeg_size(PictureKind::jpeg, unsigned_bytes(content), name, content.size());
  if (check.lacks_end) {
    completed.assign(reinterpret_cast<const char*>(content.data()), content.size());
    completed += "\xff\xd9";
    content = bytes_of(completed);
    if (!jpeg_has_all_pixels(content)) throw Error("{}: {}; copy or export the image again", name, check.damage);
    add_note(options.notes, "lack the end marker of a JPEG but no pixels; copy them again if they look damaged");
  }
  if (options.to_srgb) {
    const JpegHeader header = jpeg_header(unsigned_bytes(content));
    if (header.icc_incomplete) add_note(options.notes, "lack a part of their colour profile; it is not used");
    if (header.exif.adobe_rgb) colours = adobe_rgb();
    if (!header.icc.empty()) colours = {header.icc, std::nullopt, std::nullopt};
  }
  if (options.divisor > 1)
    if (auto reduced = decode_jpeg_reduced(content, name, options.divisor)) return std::move(*reduced);
  return stb_decode(unsigned_bytes(content), name);
}

}  // namespace

namespace {

/// Numbers of an image whose pixels are grey.
ValueMap values_of(const Image& image, const std::string& name) {
  ValueMap map{image.width, image.height, ValueMap::Numbers::bits_8, {}};
  map.values.reserve(image.rgba.size() / 4);
  for (std::size_t i = 0; i < image.rgba.size(); i += 4) {
    if (image.rgba[i] != image.rgba[i + 1] || image.rgba[i] != image.rgba[i + 2])
      throw Error("{}: shows colours, not one number per pixel; write a PNG with one channel of 16 bits", name);
    map.values.push_back(image.rgba[i]);
  }
  return map;
}

ValueMap decode_png_values(Bytes bytes, const std::string& name) {
  ColourSpace unused;
  constexpr std::size_t kBits = 24, kColourType = 25;  // of IHDR (PNG, third edition, section 11.2.1)
  if (bytes.size() <= kColourType || bytes[kBits] != 16) return values_of(decode_png(bytes, name, {}, unused), name);
  if (bytes[kColourType] != 0) throw Error("{}: a PNG of 16 bits with several channels; write one channel", name);
  check_size(name, big_endian_32(&bytes[16]), big_endian_32(&bytes[20]), bytes.size());
  if (const char* damage = png_damage(bytes)) throw Error("{}: {}; copy or export the image again", name, damage);
  return stb_decode_16(bytes, name);
}

}  // namespace

ValueMap decode_values(std::span<const std::byte> content, const std::string& name) {
  if (content.size() > (std::size_t(1) << 30)) throw Error("{}: larger than 1 GiB; write it at a smaller size", name);
  if (is_npy(content)) return decode_npy(content, name);
  const Bytes bytes = unsigned_bytes(content);
  switch (kind_of(content, name, name)) {
    case PictureKind::png:
      return decode_png_values(bytes, name);
    case PictureKind::tiff:
      return decode_tiff_values(content, name,
                                [&](ImageSize size) { check_size(name, size.width, size.height, bytes.size()); });
    default:
      throw Error("{}: its type is not read as numbers; write a PNG of 16 bits, a TIFF or a .npy file", name);
  }
}

ValueMap read_values(const std::filesystem::path& path) {
  const std::string content = read_file(path);
  return decode_values(bytes_of(content), printable(path.string()));
}

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
  // EXIF data, profiles and thumbnails, in segments of up to 64 KiB, precede the size in a JPEG.
  std::vector<std::uint8_t> head(std::size_t(1) << 18);
  head.resize(std::fread(head.data(), 1, head.size(), file.get()));
  const auto start = std::as_bytes(std::span(head));
  const PictureKind kind = kind_of(start, name, path);
  if (kind == PictureKind::jpeg && jpeg_header(head).width == 0 && head.size() < bytes) {
    const std::string content = read_file(path);
    return png_or_jpeg_size(kind, unsigned_bytes(bytes_of(content)), name, bytes);
  }
  if (kind == PictureKind::png || kind == PictureKind::jpeg) {
    ImageSize size = png_or_jpeg_size(kind, head, name, bytes);
    if (kind == PictureKind::png)
      size.orientation = png_orientation([&](std::uint64_t at, std::size_t count) {
        std::string part(count, '\0');
        if (fseeko(file.get(), static_cast<off_t>(at), SEEK_SET) != 0) return std::string();
        part.resize(std::fread(part.data(), 1, count, file.get()));
        return part;
      });
    return size;
  }
  if (kind == PictureKind::webp) {
    ImageSize size = webp_size(start, name);
    check_size(name, size.width, size.height, bytes, kMostPerByteOfWebp);
    if (webp_has_exif(start)) size.orientation = webp_exif(bytes_of(read_file(path))).orientation;
    return size;
  }
  const std::string content = read_file(path);  // a directory may be at the end of the file
  if (kind == PictureKind::tiff) {
    kind_of(bytes_of(content), name, path);  // raw photographs, if the directory was not in `head`
    const ImageSize size = tiff_size(bytes_of(content), name);
    check_size(name, size.width, size.height, bytes);
    return size;
  }
#ifdef TRISOUP_HEIF
  if (kind == PictureKind::heif) {
    const ImageSize size = heif_size(bytes_of(content), name);
    check_size(name, size.width, size.height, bytes, kMostPerByteOfWebp);
    return size;
  }
#endif
  const PlainPicture picture = checked_plain(kind, unsigned_bytes(bytes_of(content)), name);
  return {.width = static_cast<int>(picture.width), .height = static_cast<int>(picture.height)};
}

Image decode_image(std::span<const std::byte> content, const std::string& name, const DecodeOptions& options) {
  const Bytes bytes = unsigned_bytes(content);
  if (bytes.size() > (std::size_t(1) << 30))
    throw Error("{}: larger than 1 GiB; export the image at a smaller size", name);
  const auto check = [&](std::uintmax_t per_byte) {
    return [&, per_byte](ImageSize size) { check_size(name, size.width, size.height, bytes.size(), per_byte); };
  };
  ColourSpace colours;
  Image image;
  switch (const PictureKind kind = kind_of(content, name, name)) {
    case PictureKind::png:
      image = decode_png(bytes, name, options, colours);
      break;
    case PictureKind::jpeg:
      image = decode_jpeg(content, name, options, colours);
      break;
    case PictureKind::webp:
      image = decode_webp(content, name, check(kMostPerByteOfWebp), colours);
      break;
    case PictureKind::tiff:
      image = decode_tiff(content, name, check(kMostPerByte), colours);
      break;
#ifdef TRISOUP_HEIF
    case PictureKind::heif:
      image = decode_heif(content, name, check(kMostPerByteOfWebp), colours);
      break;
#endif
    default:
      image = decode_plain(kind, bytes, name, colours);
      break;
  }
  if (options.to_srgb) convert_to_srgb(image, colours, options.notes);
  return image;
}

Image read_image(const std::filesystem::path& path, const DecodeOptions& options) {
  const std::string content = read_file(path);
  return decode_image(bytes_of(content), printable(path.string()), options);
}

Image read_photograph(const std::filesystem::path& path, int divisor, std::vector<std::string>* notes) {
  return read_image(path, {divisor, true, notes});
}

}  // namespace trisoup
