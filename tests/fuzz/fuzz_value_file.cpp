// Fuzzes the readers of pictures of numbers: .npy, PNG of 16 bits, TIFF of floats.
#include "image/image_file.h"
#include "scene_reader.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace trisoup;
  return fuzz::expect_result_or_error([&] { decode_values(fuzz::bytes(data, size), "fuzz"); });
}
