// Fuzzes the reader of PLY point clouds.
#include "scene/formats/ply_points.h"
#include "scene_reader.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace trisoup;
  return fuzz::expect_result_or_error([&] {
    scene::Findings findings;
    scene::parse_ply_points(fuzz::bytes(data, size), "fuzz", findings);
    findings.lines();
  });
}
