// Fuzzes the decoders of PNG, JPEG, WebP and TIFF files, JPEG decoding at a quarter of the size, and the reader of JPEG
// headers.
#include "image/image_file.h"
#include "image/jpeg_header.h"
#include "scene_reader.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace trisoup;
  fuzz::expect_result_or_error([&] { jpeg_header({data, size}); });
  fuzz::expect_result_or_error([&] { decode_image(fuzz::bytes(data, size), "fuzz", {.divisor = 4}); });
  return fuzz::expect_result_or_error([&] { decode_image(fuzz::bytes(data, size), "fuzz"); });
}
