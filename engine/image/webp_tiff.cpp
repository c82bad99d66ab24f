#include "image/webp_tiff.h"

#include <tiffio.h>
#include <webp/decode.h>
#include <webp/encode.h>

#include <algorithm>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <memory>
#include <optional>
#include <vector>

#include "base/error.h"
#include "base/printable.h"

namespace trisoup {
namespace {

using Content = std::span<const std::byte>;

const std::uint8_t* data_of(Content bytes) { return reinterpret_cast<const std::uint8_t*>(bytes.data()); }

/// A TIFF file in memory, and the first error that libtiff reported for it.
class Tiff {
 public:
  Tiff(Content bytes, const std::string& name) : bytes_(bytes), name_(name) {
    // No strip, tile or table of a supported file is larger.
    constexpr tmsize_t kMostAtOnce = tmsize_t(1) << 30;
    const std::unique_ptr<TIFFOpenOptions, decltype(&TIFFOpenOptionsFree)> options(TIFFOpenOptionsAlloc(),
                                                                                   &TIFFOpenOptionsFree);
    TIFFOpenOptionsSetMaxSingleMemAlloc(options.get(), kMostAtOnce);
    TIFFOpenOptionsSetErrorHandlerExtR(options.get(), &Tiff::complain, this);
    TIFFOpenOptionsSetWarningHandlerExtR(options.get(), &Tiff::ignore, this);
    // The mode "m" disables memory mapping.
    file_ = TIFFClientOpenExt("tiff", "rm", this, &Tiff::read, &Tiff::write, &Tiff::seek, &Tiff::close, &Tiff::size,
                              nullptr, nullptr, options.get());
    if (file_ == nullptr) fail();
  }
  ~Tiff() {
    if (file_ != nullptr) TIFFClose(file_);
  }
  Tiff(const Tiff&) = delete;
  Tiff& operator=(const Tiff&) = delete;

  TIFF* file() const { return file_; }
  [[noreturn]] void fail() const {
    throw Error("{}: the TIFF cannot be read ({}); convert the image to PNG or JPEG", name_,
                complaint_.empty() ? "damaged" : complaint_);
  }

 private:
  static int complain(TIFF*, void* self, const char*, const char* format, va_list arguments) {
    char text[200];
    std::vsnprintf(text, sizeof text, format, arguments);
    std::string& complaint = static_cast<Tiff*>(self)->complaint_;
    if (complaint.empty()) complaint = printable(text);
    return 1;
  }
  static int ignore(TIFF*, void*, const char*, const char*, va_list) { return 1; }
  static tmsize_t read(thandle_t self, void* to, tmsize_t count) {
    Tiff& tiff = *static_cast<Tiff*>(self);
    const std::uint64_t left = tiff.bytes_.size() - std::min<std::uint64_t>(tiff.position_, tiff.bytes_.size());
    const auto taken = std::min<std::uint64_t>(left, static_cast<std::uint64_t>(std::max<tmsize_t>(count, 0)));
    if (taken > 0) std::memcpy(to, tiff.bytes_.data() + tiff.position_, taken);
    tiff.position_ += taken;
    return static_cast<tmsize_t>(taken);
  }
  static tmsize_t write(thandle_t, void*, tmsize_t) { return 0; }
  static toff_t seek(thandle_t self, toff_t offset, int from) {
    Tiff& tiff = *static_cast<Tiff*>(self);
    tiff.position_ = from == SEEK_SET ? offset : (from == SEEK_CUR ? tiff.position_ : tiff.bytes_.size()) + offset;
    return tiff.position_;
  }
  static int close(thandle_t) { return 0; }
  static toff_t size(thandle_t self) { return static_cast<Tiff*>(self)->bytes_.size(); }

  Content bytes_;
  std::string name_, complaint_;
  std::uint64_t position_ = 0;
  TIFF* file_ = nullptr;
};

/// Returns the content of a chunk of a WebP (RFC 9649, section 2), or nothing.
Content webp_chunk(Content bytes, const char* kind) {
  constexpr std::size_t kHeader = 8;
  for (std::size_t at = 12; at <= bytes.size() && bytes.size() - at >= kHeader;) {
    const std::uint8_t* head = data_of(bytes) + at;
    const std::size_t size =
        std::size_t(head[4]) | std::size_t(head[5]) << 8 | std::size_t(head[6]) << 16 | std::size_t(head[7]) << 24;
    if (size > bytes.size() - at - kHeader) return {};
    if (std::memcmp(head, kind, 4) == 0) return bytes.subspan(at + kHeader, size);
    at += kHeader + size + size % 2;
  }
  return {};
}

ImageSize size_of(const Tiff& tiff) {
  std::uint32_t width = 0, height = 0;
  TIFFGetField(tiff.file(), TIFFTAG_IMAGEWIDTH, &width);
  TIFFGetField(tiff.file(), TIFFTAG_IMAGELENGTH, &height);
  constexpr std::uint32_t kLongest = 1u << 28;
  if (width < 1 || height < 1 || width > kLongest || height > kLongest) tiff.fail();
  std::uint16_t orientation = 1;
  TIFFGetFieldDefaulted(tiff.file(), TIFFTAG_ORIENTATION, &orientation);
  return {static_cast<int>(width), static_cast<int>(height),
          orientation >= 1 && orientation <= 8 ? static_cast<int>(orientation) : 1};
}

struct TiffLayout {
  std::uint16_t bits = 1, channels = 1, photometric = PHOTOMETRIC_MINISBLACK, planes = PLANARCONFIG_CONTIG, extra = 0,
                format = SAMPLEFORMAT_UINT;
  bool tiled = false;
};

TiffLayout layout_of(const Tiff& tiff) {
  TiffLayout layout;
  std::uint16_t* kinds = nullptr;
  TIFFGetFieldDefaulted(tiff.file(), TIFFTAG_BITSPERSAMPLE, &layout.bits);
  TIFFGetFieldDefaulted(tiff.file(), TIFFTAG_SAMPLESPERPIXEL, &layout.channels);
  TIFFGetFieldDefaulted(tiff.file(), TIFFTAG_PHOTOMETRIC, &layout.photometric);
  TIFFGetFieldDefaulted(tiff.file(), TIFFTAG_PLANARCONFIG, &layout.planes);
  TIFFGetFieldDefaulted(tiff.file(), TIFFTAG_SAMPLEFORMAT, &layout.format);
  TIFFGetFieldDefaulted(tiff.file(), TIFFTAG_EXTRASAMPLES, &layout.extra, &kinds);
  layout.tiled = TIFFIsTiled(tiff.file()) != 0;
  return layout;
}

void check_layout(const TiffLayout& layout, const std::string& name) {
  constexpr std::uint16_t kLinearRaw = 34892;  // of DNG
  if (layout.photometric == PHOTOMETRIC_CFA || layout.photometric == kLinearRaw)
    throw Error("{}: holds the unprocessed pixels of a camera sensor; convert with darktable-cli IN OUT.tif", name);
  const bool depth = layout.bits == 1 || layout.bits == 2 || layout.bits == 4 || layout.bits == 8 || layout.bits == 16;
  if (!depth || layout.channels > 4 || layout.format == SAMPLEFORMAT_IEEEFP)
    throw Error("{}: TIFF with {} channels of {}{} bits is not supported; export RGB or RGBA with 8 or 16 bits", name,
                layout.channels, layout.format == SAMPLEFORMAT_IEEEFP ? "floating-point " : "", layout.bits);
}

std::string icc_of(const Tiff& tiff) {
  std::uint32_t size = 0;
  void* profile = nullptr;
  if (TIFFGetField(tiff.file(), TIFFTAG_ICCPROFILE, &size, &profile) == 0 || profile == nullptr) return {};
  return {static_cast<const char*>(profile), size};
}

/// Reads the file row by row, if its samples lie together and have 8, 16 or 32 bits. use: called with the row's
/// samples, in the byte order of this machine, and the row's position in the image.
template <typename Use>
bool read_tiff_rows(const Tiff& tiff, const ImageSize& size, const TiffLayout& layout, const Use& use) {
  const std::uint64_t row = std::uint64_t(size.width) * layout.channels * layout.bits / 8;
  const bool whole_bytes = layout.bits == 8 || layout.bits == 16 || layout.bits == 32;
  if (layout.tiled || layout.planes != PLANARCONFIG_CONTIG || !whole_bytes) return false;
  if (TIFFScanlineSize64(tiff.file()) != row) return false;
  std::vector<std::uint8_t> samples(row);
  for (int y = 0; y < size.height; ++y) {
    if (TIFFReadScanline(tiff.file(), samples.data(), static_cast<std::uint32_t>(y), 0) < 0) tiff.fail();
    use(samples, std::size_t(4) * std::size_t(size.width) * std::size_t(y));
  }
  return true;
}

std::uint16_t sample_16(const std::vector<std::uint8_t>& samples, std::size_t i) {
  std::uint16_t value = 0;
  std::memcpy(&value, &samples[2 * i], 2);
  return value;
}

Image opaque_image(const ImageSize& size) {
  return {size.width, size.height,
          std::vector<std::uint8_t>(std::size_t(size.width) * std::size_t(size.height) * 4, 255)};
}

/// Adobe TIFF 6.0, section 23, and its encoding with 16 bits (Photoshop TIFF Technical Notes); ICC.1, annex A for
/// ICCLAB, whose a and b are not signed.
double lab_value(const std::vector<std::uint8_t>& samples, std::size_t i, const TiffLayout& layout) {
  const bool is_signed = layout.photometric == PHOTOMETRIC_CIELAB, lightness = i % 3 == 0;
  if (layout.bits == 8) {
    const int value = samples[i];
    if (lightness) return value / 255.0 * 100;
    return is_signed ? static_cast<std::int8_t>(value) : value - 128;
  }
  const int value = sample_16(samples, i);
  if (lightness) return value / (is_signed ? 65535.0 : 65280.0) * 100;
  return (is_signed ? static_cast<std::int16_t>(value) : value - 32768) / 256.0;
}

Image decode_lab(const Tiff& tiff, const ImageSize& size, const TiffLayout& layout, const std::string& name) {
  const float* white = nullptr;
  TIFFGetField(tiff.file(), TIFFTAG_WHITEPOINT, &white);
  const bool usable = white != nullptr && white[0] > 0.2f && white[0] < 0.5f && white[1] > 0.2f && white[1] < 0.5f;
  constexpr double kD50[2]{0.3457, 0.3585};
  const RowsToSrgb to_srgb(usable ? double(white[0]) : kD50[0], usable ? double(white[1]) : kD50[1]);
  Image image = opaque_image(size);
  std::vector<double> lab(std::size_t(3) * std::size_t(size.width));
  const auto convert = [&](const std::vector<std::uint8_t>& samples, std::size_t at) {
    for (std::size_t i = 0; i < lab.size(); ++i) lab[i] = lab_value(samples, i, layout);
    to_srgb.convert(lab.data(), &image.rgba[at], size.width);
  };
  if (!to_srgb.valid() || layout.channels != 3 || !read_tiff_rows(tiff, size, layout, convert))
    throw Error("{}: this kind of TIFF with Lab colours is not supported; export RGB", name);
  return image;
}

/// Returns nullopt without a profile that can be used.
std::optional<Image> decode_cmyk(const Tiff& tiff, const ImageSize& size, const TiffLayout& layout,
                                 const std::string& icc) {
  const RowsToSrgb to_srgb(icc);
  if (!to_srgb.valid() || layout.channels != 4 || layout.extra != 0) return std::nullopt;
  Image image = opaque_image(size);
  std::vector<std::uint16_t> inks(std::size_t(4) * std::size_t(size.width));
  const bool read = read_tiff_rows(tiff, size, layout, [&](const std::vector<std::uint8_t>& samples, std::size_t at) {
    for (std::size_t i = 0; i < inks.size(); ++i)
      inks[i] = layout.bits == 8 ? static_cast<std::uint16_t>(samples[i] * 257) : sample_16(samples, i);
    to_srgb.convert(inks.data(), &image.rgba[at], size.width);
  });
  if (!read) return std::nullopt;
  return image;
}

/// Decodes what libtiff converts to RGBA.
Image decode_rgba(const Tiff& tiff, const ImageSize& size) {
  // Ignores the orientation of the file, as for JPEG.
  TIFFSetField(tiff.file(), TIFFTAG_ORIENTATION, ORIENTATION_TOPLEFT);
  const std::size_t pixels = std::size_t(size.width) * std::size_t(size.height);
  Image image{size.width, size.height, std::vector<std::uint8_t>(pixels * 4)};
  std::vector<std::uint32_t> raster(pixels);
  if (TIFFReadRGBAImageOriented(tiff.file(), static_cast<std::uint32_t>(size.width),
                                static_cast<std::uint32_t>(size.height), raster.data(), ORIENTATION_TOPLEFT, 1) == 0)
    tiff.fail();
  for (std::size_t i = 0; i < pixels; ++i) {
    const std::uint32_t colour[3]{TIFFGetR(raster[i]), TIFFGetG(raster[i]), TIFFGetB(raster[i])},
        alpha = TIFFGetA(raster[i]);
    // Undoes the multiplication of colours by alpha that libtiff does.
    for (std::size_t c = 0; c < 3; ++c)
      image.rgba[4 * i + c] = static_cast<std::uint8_t>(
          alpha == 255 || alpha == 0 ? colour[c] : std::min(255u, (colour[c] * 255 + alpha / 2) / alpha));
    image.rgba[4 * i + 3] = static_cast<std::uint8_t>(alpha);
  }
  return image;
}

}  // namespace

ImageSize webp_size(Content bytes, const std::string& name) {
  WebPBitstreamFeatures features;
  if (WebPGetFeatures(data_of(bytes), bytes.size(), &features) != VP8_STATUS_OK)
    throw Error("{}: the WebP header is damaged; export the image again", name);
  if (features.has_animation) throw Error("{}: animations are not supported; export a single picture", name);
  return {features.width, features.height};
}

bool webp_has_exif(Content bytes) {
  constexpr unsigned kExifFlag = 8;
  const Content header = webp_chunk(bytes, "VP8X");
  return !header.empty() && (data_of(header)[0] & kExifFlag) != 0;
}

Exif webp_exif(Content bytes) {
  const Content exif = webp_chunk(bytes, "EXIF");
  return read_exif({data_of(exif), exif.size()});
}

Image decode_webp(Content bytes, const std::string& name, const CheckSize& check, ColourSpace& colours) {
  const Content profile = webp_chunk(bytes, "ICCP");
  if (profile.empty() && webp_exif(bytes).adobe_rgb)
    colours = adobe_rgb();
  else
    colours.icc.assign(reinterpret_cast<const char*>(profile.data()), profile.size());
  const ImageSize size = webp_size(bytes, name);
  check(size);
  Image image{size.width, size.height,
              std::vector<std::uint8_t>(std::size_t(size.width) * std::size_t(size.height) * 4)};
  if (WebPDecodeRGBAInto(data_of(bytes), bytes.size(), image.rgba.data(), image.rgba.size(), 4 * size.width) == nullptr)
    throw Error("{}: the WebP is damaged or cut off; copy or export the image again", name);
  return image;
}

std::string encode_webp(const Image& image, float quality, const std::string& name) {
  std::vector<std::uint8_t> rgb;
  rgb.reserve(image.rgba.size() / 4 * 3);
  for (std::size_t i = 0; i < image.rgba.size(); i += 4) rgb.insert(rgb.end(), &image.rgba[i], &image.rgba[i] + 3);
  std::uint8_t* output = nullptr;
  const std::size_t size = WebPEncodeRGB(rgb.data(), image.width, image.height, 3 * image.width, quality, &output);
  const std::unique_ptr<std::uint8_t, decltype(&WebPFree)> bytes(output, &WebPFree);
  if (size == 0)
    throw Error("{}: {} x {} pixels cannot be encoded as WebP; use a smaller picture", name, image.width, image.height);
  return {reinterpret_cast<const char*>(bytes.get()), size};
}

ImageSize tiff_size(Content bytes, const std::string& name) { return size_of(Tiff(bytes, name)); }

Image decode_tiff(Content bytes, const std::string& name, const CheckSize& check, ColourSpace& colours) {
  const Tiff tiff(bytes, name);
  const ImageSize size = size_of(tiff);
  check(size);
  const TiffLayout layout = layout_of(tiff);
  check_layout(layout, name);
  colours.icc = icc_of(tiff);
  if (layout.photometric == PHOTOMETRIC_CIELAB || layout.photometric == PHOTOMETRIC_ICCLAB) {
    colours = {};
    return decode_lab(tiff, size, layout, name);
  }
  if (layout.photometric == PHOTOMETRIC_SEPARATED) {
    if (auto converted = decode_cmyk(tiff, size, layout, colours.icc)) {
      colours = {};
      return std::move(*converted);
    }
    if (layout.bits == 16)
      throw Error(
          "{}: CMYK of 16 bits is not supported; export RGB, for example with magick IN -colorspace sRGB OUT.tif",
          name);
  }
  return decode_rgba(tiff, size);
}

ValueMap decode_tiff_values(Content bytes, const std::string& name, const CheckSize& check) {
  const Tiff tiff(bytes, name);
  const ImageSize size = size_of(tiff);
  check(size);
  const TiffLayout layout = layout_of(tiff);
  const bool real = layout.format == SAMPLEFORMAT_IEEEFP;
  using Numbers = ValueMap::Numbers;
  ValueMap map{size.width, size.height, real ? Numbers::real : layout.bits == 8 ? Numbers::bits_8 : Numbers::whole, {}};
  map.values.resize(std::size_t(size.width) * std::size_t(size.height));
  const auto take = [&](const std::vector<std::uint8_t>& samples, std::size_t at) {
    float* out = &map.values[at / 4];
    for (std::size_t i = 0; i < std::size_t(size.width); ++i, ++out)
      if (real)
        std::memcpy(out, &samples[4 * i], 4);
      else
        *out = layout.bits == 8 ? static_cast<float>(samples[i]) : static_cast<float>(sample_16(samples, i));
  };
  const bool known = layout.channels == 1 && (real ? layout.bits == 32 : layout.bits == 8 || layout.bits == 16);
  if (!known || !read_tiff_rows(tiff, size, layout, take))
    throw Error("{}: this kind of TIFF is not read as numbers; write one channel of 16 bits or floats, without tiles",
                name);
  return map;
}

}  // namespace trisoup
