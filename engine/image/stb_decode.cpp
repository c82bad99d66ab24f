#include "image/stb_decode.h"

#include <cstdlib>
#include <memory>

#include "base/error.h"

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
#define STBI_ONLY_BMP
#define STBI_ONLY_GIF
#define STBI_ONLY_TGA
#define STBI_ONLY_PSD
#define STBI_NO_LINEAR
#include <stb/stb_image.h>
#pragma GCC diagnostic pop
#ifdef __clang__
#pragma clang attribute pop
#endif

namespace trisoup {

Image stb_decode(std::span<const std::uint8_t> bytes, const std::string& name) {
  Image image;
  int channels = 0;
  const std::unique_ptr<stbi_uc, decltype(&std::free)> pixels(
      stbi_load_from_memory(bytes.data(), static_cast<int>(bytes.size()), &image.width, &image.height, &channels, 4),
      &std::free);
  if (!pixels) throw Error("{}: cannot be decoded ({}); export the image again", name, stbi_failure_reason());
  image.rgba.assign(pixels.get(), pixels.get() + std::size_t(image.width) * std::size_t(image.height) * 4);
  return image;
}

ValueMap stb_decode_16(std::span<const std::uint8_t> bytes, const std::string& name) {
  ValueMap map;
  map.numbers = ValueMap::Numbers::whole;
  int channels = 0;
  const std::unique_ptr<stbi_us, decltype(&std::free)> values(
      stbi_load_16_from_memory(bytes.data(), static_cast<int>(bytes.size()), &map.width, &map.height, &channels, 1),
      &std::free);
  if (!values) throw Error("{}: cannot be decoded ({}); export the image again", name, stbi_failure_reason());
  map.values.assign(values.get(), values.get() + std::size_t(map.width) * std::size_t(map.height));
  return map;
}

const char* stb_size(std::span<const std::uint8_t> start, int& width, int& height) {
  int channels = 0;
  const int found = stbi_info_from_memory(start.data(), static_cast<int>(start.size()), &width, &height, &channels);
  return found != 0 ? nullptr : stbi_failure_reason();
}

}  // namespace trisoup
