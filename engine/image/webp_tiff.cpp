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

ImageSize size_of(const Tiff& tiff) {
  std::uint32_t width = 0, height = 0;
  TIFFGetField(tiff.file(), TIFFTAG_IMAGEWIDTH, &width);
  TIFFGetField(tiff.file(), TIFFTAG_IMAGELENGTH, &height);
  constexpr std::uint32_t kLongest = 1u << 28;
  if (width < 1 || height < 1 || width > kLongest || height > kLongest) tiff.fail();
  return {static_cast<int>(width), static_cast<int>(height)};
}

}  // namespace

bool is_webp(Content bytes) {
  return bytes.size() >= 12 && std::memcmp(bytes.data(), "RIFF", 4) == 0 &&
         std::memcmp(bytes.data() + 8, "WEBP", 4) == 0;
}

bool is_tiff(Content bytes) {
  if (bytes.size() < 8) return false;
  for (const char* start : {"II*\0", "MM\0*", "II+\0", "MM\0+"})
    if (std::memcmp(bytes.data(), start, 4) == 0) return true;
  return false;
}

ImageSize webp_size(Content bytes, const std::string& name) {
  WebPBitstreamFeatures features;
  if (WebPGetFeatures(data_of(bytes), bytes.size(), &features) != VP8_STATUS_OK)
    throw Error("{}: the WebP header is damaged; export the image again", name);
  if (features.has_animation) throw Error("{}: animations are not supported; export a single picture", name);
  return {features.width, features.height};
}

Image decode_webp(Content bytes, const std::string& name, const CheckSize& check) {
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

Image decode_tiff(Content bytes, const std::string& name, const CheckSize& check) {
  const Tiff tiff(bytes, name);
  const ImageSize size = size_of(tiff);
  check(size);
  std::uint16_t bits = 1, channels = 1;
  TIFFGetFieldDefaulted(tiff.file(), TIFFTAG_BITSPERSAMPLE, &bits);
  TIFFGetFieldDefaulted(tiff.file(), TIFFTAG_SAMPLESPERPIXEL, &channels);
  if ((bits != 8 && bits != 16) || channels > 4)
    throw Error("{}: TIFF with {} channels of {} bits is not supported; export RGB or RGBA with 8 or 16 bits", name,
                channels, bits);
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

}  // namespace trisoup
