#ifdef TRISOUP_HEIF

#include "image/heif_file.h"

#include <libheif/heif.h>

#include <cstdint>
#include <cstring>
#include <memory>

#include "base/error.h"
#include "base/printable.h"

namespace trisoup {
namespace {

template <auto free_object>
struct HeifDeleter {
  template <typename T>
  void operator()(T* object) const {
    free_object(object);
  }
};
using HeifContext = std::unique_ptr<heif_context, HeifDeleter<heif_context_free>>;
using HeifHandle = std::unique_ptr<heif_image_handle, HeifDeleter<heif_image_handle_release>>;
using HeifImage = std::unique_ptr<heif_image, HeifDeleter<heif_image_release>>;
using HeifCodes = std::unique_ptr<heif_color_profile_nclx, HeifDeleter<heif_nclx_color_profile_free>>;

/// A HEIF file in memory, opened at its primary picture.
class HeifFile {
 public:
  HeifFile(std::span<const std::byte> bytes, const std::string& name) : name_(name), context_(heif_context_alloc()) {
    check(heif_context_read_from_memory_without_copy(context_.get(), bytes.data(), bytes.size(), nullptr));
    heif_image_handle* handle = nullptr;
    check(heif_context_get_primary_image_handle(context_.get(), &handle));
    handle_.reset(handle);
  }

  ImageSize size() const {
    return {heif_image_handle_get_width(handle_.get()), heif_image_handle_get_height(handle_.get())};
  }

  HeifImage decode() const {
    heif_image* image = nullptr;
    check(heif_decode_image(handle_.get(), &image, heif_colorspace_RGB, heif_chroma_interleaved_RGBA, nullptr));
    return HeifImage(image);
  }

  ColourSpace colours() const {
    const heif_color_profile_type type = heif_image_handle_get_color_profile_type(handle_.get());
    if (type == heif_color_profile_type_prof || type == heif_color_profile_type_rICC) {
      std::string icc(heif_image_handle_get_raw_color_profile_size(handle_.get()), '\0');
      if (!icc.empty()) check(heif_image_handle_get_raw_color_profile(handle_.get(), icc.data()));
      return {std::move(icc), std::nullopt, std::nullopt};
    }
    heif_color_profile_nclx* codes = nullptr;
    const heif_error problem = heif_image_handle_get_nclx_color_profile(handle_.get(), &codes);
    const HeifCodes owner(codes);
    if (problem.code != heif_error_Ok || codes == nullptr) return {};
    return colour_space_of_codes(codes->color_primaries, codes->transfer_characteristics, name_);
  }

  bool has_alpha() const { return heif_image_handle_has_alpha_channel(handle_.get()) != 0; }

 private:
  void check(const heif_error& problem) const {
    if (problem.code == heif_error_Ok) return;
    const std::string reason = printable(problem.message != nullptr ? problem.message : "");
    if (problem.code == heif_error_Unsupported_feature || problem.code == heif_error_Unsupported_filetype)
      throw Error("{}: libheif cannot decode it ({}); convert with heif-convert IN OUT.jpg on another machine", name_,
                  reason);
    throw Error("{}: is damaged or cut off ({}); copy or export the image again", name_, reason);
  }

  std::string name_;
  HeifContext context_;
  HeifHandle handle_;
};

}  // namespace

ImageSize heif_size(std::span<const std::byte> bytes, const std::string& name) { return HeifFile(bytes, name).size(); }

Image decode_heif(std::span<const std::byte> bytes, const std::string& name, const CheckSize& check,
                  ColourSpace& colours) {
  const HeifFile file(bytes, name);
  check(file.size());
  colours = file.colours();
  const HeifImage decoded = file.decode();
  const int width = heif_image_get_width(decoded.get(), heif_channel_interleaved),
            height = heif_image_get_height(decoded.get(), heif_channel_interleaved);
  int stride = 0;
  const std::uint8_t* pixels = heif_image_get_plane_readonly(decoded.get(), heif_channel_interleaved, &stride);
  if (pixels == nullptr || width < 1 || height < 1 || std::int64_t(stride) < std::int64_t(width) * 4)
    throw Error("{}: is damaged or cut off; copy or export the image again", name);
  check({width, height});
  Image image{width, height, std::vector<std::uint8_t>(std::size_t(4) * std::size_t(width) * std::size_t(height))};
  const std::size_t row = std::size_t(4) * std::size_t(width);
  for (std::size_t y = 0; y < std::size_t(height); ++y)
    std::memcpy(&image.rgba[y * row], pixels + y * std::size_t(stride), row);
  if (!file.has_alpha())
    for (std::size_t i = 3; i < image.rgba.size(); i += 4) image.rgba[i] = 255;
  return image;
}

}  // namespace trisoup

#endif
