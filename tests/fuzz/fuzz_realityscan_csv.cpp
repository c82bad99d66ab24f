// Fuzzes the reader of RealityScan's camera parameters.
#include <string_view>

#include "scene/formats/realityscan_csv.h"
#include "scene_reader.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace trisoup;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  return fuzz::expect_result_or_error([&] {
    scene::looks_like_realityscan_csv(text);
    for (const scene::RealityScanCamera& camera : scene::parse_realityscan_csv(text, "fuzz").cameras)
      scene::camera_of(camera, {640, 480});
  });
}
