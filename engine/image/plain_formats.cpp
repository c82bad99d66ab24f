#include "image/plain_formats.h"

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <cstdlib>
#include <optional>
#include <string_view>

#include "base/error.h"

namespace trisoup {
namespace {

using Bytes = std::span<const std::uint8_t>;

constexpr const char* kCut = "cut off before its end";
constexpr const char* kStrange = "has impossible values in its header";

/// Reads numbers in order. Reading past the end gives 0 and is remembered.
class Fields {
 public:
  Fields(Bytes bytes, bool little) : bytes_(bytes), little_(little) {}

  std::uint32_t number(std::size_t size) {
    if (!has(size)) {
      past_end_ = true;
      return 0;
    }
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < size; ++i)
      value |= std::uint32_t(bytes_[position_ + i]) << 8 * (little_ ? i : size - 1 - i);
    position_ += size;
    return value;
  }
  void skip(std::uint64_t size) {
    past_end_ = past_end_ || !has(size);
    if (!past_end_) position_ += size;
  }
  bool has(std::uint64_t size) const { return !past_end_ && size <= bytes_.size() - position_; }
  bool past_end() const { return past_end_; }
  std::size_t position() const { return position_; }

 private:
  Bytes bytes_;
  bool little_;
  std::size_t position_ = 0;
  bool past_end_ = false;
};

std::string text_at(Bytes bytes, std::uint64_t at, std::uint64_t size) {
  if (at > bytes.size() || size > bytes.size() - at) return {};
  return {reinterpret_cast<const char*>(bytes.data()) + at, static_cast<std::size_t>(size)};
}

struct BmpHeader {
  std::uint32_t offset = 0, length = 0, bits = 0, compression = 0;
  std::uint64_t width = 0, height = 0, row = 0;  // row: bytes, a multiple of 4
};

/// Returns whether all pixels have a colour in the palette.
bool palette_suffices(Bytes bytes, const BmpHeader& bmp) {
  const std::uint32_t colours = (bmp.offset - 14 - bmp.length) / 4, per_byte = 8 / bmp.bits,
                      mask = (1u << bmp.bits) - 1;
  if (colours < 1 || colours > 256) return false;
  if (colours > mask) return true;
  for (std::uint64_t y = 0; y < bmp.height; ++y)
    for (std::uint64_t x = 0; x < bmp.width; ++x) {
      const std::uint32_t byte = bytes[bmp.offset + y * bmp.row + x / per_byte];
      if ((byte >> (per_byte - 1 - x % per_byte) * bmp.bits & mask) >= colours) return false;
    }
  return true;
}

const char* bmp_problem(Bytes bytes, const BmpHeader& bmp, std::uint32_t planes) {
  constexpr std::uint32_t kNone = 0, kMasks = 3;
  const bool usual = bmp.length == 40 || bmp.length == 108 || bmp.length == 124 ||
                     (bmp.length == 56 && bmp.compression == kNone) || (bmp.length == 12 && bmp.bits == 24);
  if (!usual) return "is a BMP of a rare version";
  if (bmp.compression == 1 || bmp.compression == 2) return "is a BMP with run-length coding";
  if (bmp.compression != kNone && bmp.compression != kMasks) return "is a BMP with compression";
  const bool depth =
      bmp.bits == 1 || bmp.bits == 4 || bmp.bits == 8 || bmp.bits == 16 || bmp.bits == 24 || bmp.bits == 32;
  if (planes != 1 || !depth || (bmp.compression == kMasks && bmp.bits != 16 && bmp.bits != 32)) return kStrange;
  const std::uint32_t masks = bmp.compression == kMasks && bmp.length == 40 ? 12 : 0;
  if (bmp.offset < 14 + bmp.length + masks) return kStrange;
  if (bmp.offset > bytes.size() || bmp.row * bmp.height > bytes.size() - bmp.offset) return kCut;
  if (bmp.bits <= 8 && !palette_suffices(bytes, bmp)) return "lacks colours of its palette";
  return nullptr;
}

PlainPicture examine_bmp(Bytes bytes) {
  Fields fields(bytes, true);
  fields.skip(10);
  BmpHeader bmp;
  bmp.offset = fields.number(4);
  bmp.length = fields.number(4);
  const std::size_t side = bmp.length == 12 ? 2 : 4;
  bmp.width = fields.number(side);
  // A negative height means that the rows start at the top.
  bmp.height = static_cast<std::uint64_t>(std::abs(std::int64_t(static_cast<std::int32_t>(fields.number(side)))));
  const std::uint32_t planes = fields.number(2);
  bmp.bits = fields.number(2);
  if (bmp.length != 12) bmp.compression = fields.number(4);
  if (fields.past_end()) return {0, 0, kCut};
  constexpr std::uint64_t kLongest = 1 << 24;  // of stb_image
  if (bmp.width < 1 || bmp.height < 1 || bmp.width > kLongest || bmp.height > kLongest) return {0, 0, kStrange};
  bmp.row = (bmp.width * bmp.bits + 31) / 32 * 4;
  PlainPicture picture{std::int64_t(bmp.width), std::int64_t(bmp.height), bmp_problem(bytes, bmp, planes)};
  constexpr std::size_t kStart = 14;
  if (bmp.length == 124 && text_at(bytes, kStart + 56, 4) == "DEBM") {  // PROFILE_EMBEDDED
    Fields profile(bytes.subspan(kStart + 112), true);
    const std::uint64_t at = profile.number(4), size = profile.number(4);
    picture.icc = text_at(bytes, kStart + at, size);
  }
  return picture;
}

/// Skips blocks of up to 255 bytes, each after its length, up to an empty one.
void skip_blocks(Fields& fields) {
  while (!fields.past_end()) {
    const std::uint32_t length = fields.number(1);
    if (length == 0) return;
    fields.skip(length);
  }
}

PlainPicture examine_gif(Bytes bytes) {
  Fields fields(bytes, true);
  const auto skip_colours = [&](std::uint32_t flags) {
    if ((flags & 0x80) != 0) fields.skip(std::uint64_t(3) * (2u << (flags & 7)));
    return (flags & 0x80) != 0;
  };
  fields.skip(6);
  PlainPicture picture;
  picture.width = fields.number(2);
  picture.height = fields.number(2);
  const std::uint32_t flags = fields.number(1);
  fields.skip(2);
  const bool has_colours = skip_colours(flags);
  constexpr std::uint32_t kExtension = 0x21, kPicture = 0x2c, kEnd = 0x3b;
  while (!fields.past_end()) {
    const std::uint32_t kind = fields.number(1);
    if (fields.past_end()) break;
    if (kind == kExtension) {
      fields.skip(1);
      skip_blocks(fields);
      continue;
    }
    if (kind != kPicture) picture.problem = kind == kEnd ? "holds no picture" : "is damaged";
    if (kind != kPicture) return picture;
    const std::uint32_t left = fields.number(2), top = fields.number(2), width = fields.number(2),
                        height = fields.number(2);
    const bool own_colours = skip_colours(fields.number(1));
    const std::uint32_t code_bits = fields.number(1);
    skip_blocks(fields);
    if (fields.past_end()) break;
    if (!own_colours && !has_colours) picture.problem = "has no palette";
    if (left != 0 || top != 0 || width != picture.width || height != picture.height)
      picture.problem = "has a first picture that does not fill it";
    if (code_bits < 1 || code_bits > 8) picture.problem = "is damaged";
    return picture;
  }
  picture.problem = kCut;
  return picture;
}

struct TgaHeader {
  std::uint32_t type = 0, first_colour = 0, colours = 0, colour_bits = 0, bits = 0, flags = 0;
  bool has_palette = false;
  std::uint64_t pixels = 0;
};

const char* tga_variant_problem(const TgaHeader& tga) {
  const std::uint32_t kind = tga.type & 7;
  if ((tga.type & ~std::uint32_t(8)) != kind || kind < 1 || kind > 3) return "is not a TGA that is read, or is damaged";
  if (tga.has_palette != (kind == 1)) return "is a TGA with a palette that it does not use";
  const auto is_colour = [](std::uint32_t bits) { return bits == 15 || bits == 16 || bits == 24 || bits == 32; };
  if (kind == 1 &&
      (tga.colours < 1 || tga.first_colour != 0 || !is_colour(tga.colour_bits) || (tga.bits != 8 && tga.bits != 16)))
    return "is a TGA with a rare palette";
  if ((kind == 2 && !is_colour(tga.bits)) || (kind == 3 && tga.bits != 8 && tga.bits != 16)) return kStrange;
  constexpr std::uint32_t kFromRight = 0x10, kFromTop = 0x20, kInterleaved = 0xc0;
  // ImageMagick 6 writes rows from the top without saying so.
  if ((tga.flags & (kFromRight | kFromTop | kInterleaved)) != kFromTop)
    return "is a TGA whose first row may be at the top or at the bottom";
  return nullptr;
}

/// Returns whether the pixels of a TGA are all there.
bool has_tga_pixels(Fields& fields, const TgaHeader& tga) {
  const std::uint64_t bytes = (tga.bits + 7) / 8;
  if ((tga.type & 8) == 0) return fields.has(tga.pixels * bytes);
  for (std::uint64_t done = 0; done < tga.pixels;) {
    const std::uint32_t packet = fields.number(1), count = (packet & 127) + 1;
    fields.skip((packet & 128) != 0 ? bytes : bytes * count);
    if (fields.past_end()) return false;
    done += count;
  }
  return true;
}

PlainPicture examine_tga(Bytes bytes) {
  Fields fields(bytes, true);
  TgaHeader tga;
  const std::uint32_t comment = fields.number(1), palette = fields.number(1);
  tga.has_palette = palette != 0;
  tga.type = fields.number(1);
  tga.first_colour = fields.number(2);
  tga.colours = fields.number(2);
  tga.colour_bits = fields.number(1);
  fields.skip(4);
  PlainPicture picture;
  picture.width = fields.number(2);
  picture.height = fields.number(2);
  tga.bits = fields.number(1);
  tga.flags = fields.number(1);
  if (fields.past_end()) return {0, 0, kCut};
  tga.pixels = std::uint64_t(picture.width) * std::uint64_t(picture.height);
  picture.opaque = (tga.flags & 15) == 0;  // bits of alpha
  picture.problem = palette > 1 ? kStrange : tga_variant_problem(tga);
  if (picture.problem != nullptr) return picture;
  fields.skip(comment);
  if (tga.has_palette) fields.skip(std::uint64_t(tga.colours) * ((tga.colour_bits + 7) / 8));
  if (!has_tga_pixels(fields, tga)) picture.problem = kCut;
  return picture;
}

/// Reads the image resources of a PSD: its colour profile, and whether it holds the merged picture.
void read_psd_resources(Bytes bytes, PlainPicture& picture) {
  constexpr std::uint32_t kSignature = 0x3842494d, kProfile = 1039, kVersion = 1057;  // "8BIM"
  Fields fields(bytes, false);
  while (fields.has(12) && fields.number(4) == kSignature) {
    const std::uint32_t kind = fields.number(2);
    const std::uint32_t name = fields.number(1);
    fields.skip(name | 1);  // with its length, a multiple of 2
    const std::uint32_t size = fields.number(4);
    if (!fields.has(size)) return;
    if (kind == kProfile) picture.icc = text_at(bytes, fields.position(), size);
    if (kind == kVersion && size > 4 && bytes[fields.position() + 4] == 0)
      picture.problem = "is a PSD without the merged picture (saved without maximum compatibility)";
    fields.skip(std::uint64_t(size) + size % 2);
  }
}

PlainPicture examine_psd(Bytes bytes) {
  Fields fields(bytes, false);
  fields.skip(4);
  const std::uint32_t version = fields.number(2);
  fields.skip(6);
  const std::uint64_t channels = fields.number(2), height = fields.number(4), width = fields.number(4),
                      bits = fields.number(2), mode = fields.number(2);
  if (fields.past_end()) return {0, 0, kCut};
  constexpr std::uint64_t kLongest = 30000;  // of the format
  constexpr std::uint32_t kRgb = 3;
  if (width < 1 || height < 1 || width > kLongest || height > kLongest) return {0, 0, kStrange};
  PlainPicture picture{std::int64_t(width), std::int64_t(height)};
  if (version != 1 || mode != kRgb || channels != 3 || bits != 8)
    picture.problem = "is a PSD with other than three channels of 8 bits (RGB without alpha)";
  fields.skip(fields.number(4));  // palette
  const std::uint32_t resources = fields.number(4);
  if (fields.has(resources)) read_psd_resources(bytes.subspan(fields.position(), resources), picture);
  fields.skip(resources);
  fields.skip(fields.number(4));  // layers
  const std::uint32_t compression = fields.number(2);
  if (fields.past_end()) picture.problem = kCut;
  if (picture.problem != nullptr) return picture;
  if (compression > 1) picture.problem = "is a PSD with ZIP compression";
  std::uint64_t expected = channels * width * height;
  if (compression == 1) {
    expected = 0;
    for (std::uint64_t row = 0; row < channels * height; ++row) expected += fields.number(2);
  }
  if (!fields.has(expected)) picture.problem = kCut;
  return picture;
}

/// Header of a file of the PBM family.
struct Pnm {
  int kind = 0;  // 1 to 6
  std::uint64_t width = 0, height = 0, most = 1;
  std::size_t start = 0;  // of the pixels

  std::uint64_t samples() const { return width * height * (kind == 3 || kind == 6 ? 3 : 1); }
};

/// Reads a number after blanks and comments. Returns nullopt if there is none or it is too large.
std::optional<std::uint64_t> pnm_number(Bytes bytes, std::size_t& at) {
  while (at < bytes.size() && (std::isspace(bytes[at]) != 0 || bytes[at] == '#'))
    if (bytes[at++] == '#')
      while (at < bytes.size() && bytes[at] != '\n') ++at;
  std::uint64_t value = 0;
  const std::size_t first = at;
  for (; at < bytes.size() && std::isdigit(bytes[at]) != 0 && value < (1u << 30); ++at)
    value = value * 10 + (bytes[at] - '0');
  if (at == first || value >= (1u << 30)) return std::nullopt;
  return value;
}

std::optional<Pnm> pnm_header(Bytes bytes) {
  if (bytes.size() < 3) return std::nullopt;
  Pnm pnm;
  pnm.kind = bytes[1] - '0';
  std::size_t at = 2;
  const auto width = pnm_number(bytes, at), height = pnm_number(bytes, at);
  const auto most = pnm.kind == 1 || pnm.kind == 4 ? 1 : pnm_number(bytes, at);
  if (!width || !height || !most || *width < 1 || *height < 1 || *most < 1 || *most > 65535) return std::nullopt;
  pnm.width = *width;
  pnm.height = *height;
  pnm.most = *most;
  pnm.start = at + 1;  // a single blank
  return pnm;
}

PlainPicture examine_pnm(Bytes bytes) {
  const std::optional<Pnm> pnm = pnm_header(bytes);
  if (!pnm) return {0, 0, "has a damaged header"};
  PlainPicture picture{std::int64_t(pnm->width), std::int64_t(pnm->height)};
  const std::uint64_t left = bytes.size() - std::min(pnm->start, bytes.size());
  std::uint64_t expected = pnm->samples();  // text has at least one character for each
  if (pnm->kind == 4) expected = (pnm->width + 7) / 8 * pnm->height;
  if (pnm->kind > 4 && pnm->most > 255) expected *= 2;
  if (left < expected) picture.problem = kCut;
  return picture;
}

/// Samples of a file of the PBM family, in order.
class PnmSamples {
 public:
  PnmSamples(Bytes bytes, const Pnm& pnm) : bytes_(bytes), pnm_(pnm), at_(pnm.start) {}

  /// Returns the next sample, scaled to 255, or nullopt if it is missing or is not a number.
  std::optional<std::uint8_t> next(std::uint64_t x) {
    const std::optional<std::uint64_t> value = stored(x);
    if (!value || *value > pnm_.most) return std::nullopt;
    if (pnm_.kind == 1 || pnm_.kind == 4) return std::uint8_t(*value != 0 ? 0 : 255);  // 1 is black
    if (pnm_.most == 255) return std::uint8_t(*value);
    if (pnm_.most == 65535) return std::uint8_t(*value >> 8);
    return std::uint8_t((*value * 255 + pnm_.most / 2) / pnm_.most);
  }

 private:
  std::optional<std::uint64_t> stored(std::uint64_t x) {
    if (pnm_.kind == 1) {  // digits may follow each other
      while (at_ < bytes_.size() && std::isspace(bytes_[at_]) != 0) ++at_;
      if (at_ >= bytes_.size() || bytes_[at_] < '0') return std::nullopt;
      return std::uint64_t(bytes_[at_++] - '0');
    }
    if (pnm_.kind <= 3) return pnm_number(bytes_, at_);
    if (pnm_.kind == 4) {
      const std::uint64_t bit = bytes_[at_] >> (7 - x % 8) & 1;
      if (x % 8 == 7 || x + 1 == pnm_.width) ++at_;
      return bit;
    }
    const std::uint64_t high = bytes_[at_++];
    return pnm_.most > 255 ? high << 8 | bytes_[at_++] : high;
  }

  Bytes bytes_;
  Pnm pnm_;
  std::size_t at_;
};

}  // namespace

PlainPicture examine_plain(PictureKind kind, Bytes bytes) {
  switch (kind) {
    case PictureKind::bmp:
      return examine_bmp(bytes);
    case PictureKind::gif:
      return examine_gif(bytes);
    case PictureKind::tga:
      return examine_tga(bytes);
    case PictureKind::psd:
      return examine_psd(bytes);
    default:
      return examine_pnm(bytes);
  }
}

Image decode_pnm(Bytes bytes, const std::string& name) {
  const Pnm pnm = pnm_header(bytes).value_or(Pnm());
  Image image{static_cast<int>(pnm.width), static_cast<int>(pnm.height), {}};
  image.rgba.resize(std::size_t(4) * pnm.width * pnm.height, 255);
  PnmSamples samples(bytes, pnm);
  const std::size_t channels = pnm.samples() / std::max<std::uint64_t>(1, pnm.width * pnm.height);
  for (std::size_t i = 0; i < image.rgba.size() / 4; ++i)
    for (std::size_t c = 0; c < channels; ++c) {
      const std::optional<std::uint8_t> sample = samples.next(i % pnm.width);
      if (!sample) throw Error("{}: the PPM is damaged or cut off; copy or export the image again", name);
      image.rgba[4 * i + c] = *sample;
      if (channels == 1) image.rgba[4 * i + 1] = image.rgba[4 * i + 2] = *sample;
    }
  return image;
}

}  // namespace trisoup
