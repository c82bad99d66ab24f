// Fuzzes the reader of COLMAP's cameras.bin.
#include "scene/formats/colmap_model.h"
#include "scene_reader.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace trisoup;
  return fuzz::expect_result_or_error([&] { scene::parse_colmap_cameras_binary(fuzz::bytes(data, size), "fuzz"); });
}
