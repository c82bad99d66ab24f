// Fuzzes the decoders of pictures, with colours as stored and in sRGB, JPEG decoding at a quarter of the size, and the
// readers of headers.
#include <algorithm>
#include <string>

#include "image/image_file.h"
#include "image/jpeg_header.h"
#include "image/picture_type.h"
#include "image/png_chunks.h"
#include "scene_reader.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace trisoup;
  // libheif and its decoders are tested by their own fuzzers, and would take most of the time.
  const PictureType* type = picture_type(fuzz::bytes(data, size));
  if (type != nullptr && type->kind == PictureKind::heif) return 0;
  fuzz::expect_result_or_error([&] { jpeg_header({data, size}); });
  fuzz::expect_result_or_error([&] {
    png_orientation([&](std::uint64_t at, std::size_t count) {
      const std::size_t from = at < size ? static_cast<std::size_t>(at) : size;
      return std::string(reinterpret_cast<const char*>(data) + from, std::min(count, size - from));
    });
  });
  fuzz::expect_result_or_error([&] { decode_image(fuzz::bytes(data, size), "fuzz", {4, true, nullptr}); });
  return fuzz::expect_result_or_error([&] { decode_image(fuzz::bytes(data, size), "fuzz.tga"); });
}
