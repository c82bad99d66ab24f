// Fuzzes the reader of COLMAP's images.bin.
#include "scene/formats/colmap_model.h"
#include "scene_reader.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace trisoup;
  return fuzz::expect_result_or_error([&] {
    scene::Findings findings;
    scene::parse_colmap_images_binary(fuzz::bytes(data, size), "fuzz", findings);
    findings.lines();
  });
}
