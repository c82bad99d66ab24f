// Fuzzes the readers of COLMAP's text files. The first byte chooses the reader: c (cameras), i (images), else points.
#include <string_view>

#include "scene/formats/colmap_model.h"
#include "scene_reader.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace trisoup;
  if (size == 0) return 0;
  const std::string_view text(reinterpret_cast<const char*>(data) + 1, size - 1);
  return fuzz::expect_result_or_error([&] {
    scene::Findings findings;
    if (data[0] == 'c')
      scene::parse_colmap_cameras_text(text, "fuzz");
    else if (data[0] == 'i')
      scene::parse_colmap_images_text(text, "fuzz", findings);
    else
      scene::parse_colmap_points_text(text, "fuzz", findings);
  });
}
