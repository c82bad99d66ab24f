// Fuzzes the reader of camera paths, and cameras along what it reads.
#include <cmath>
#include <string_view>

#include "render/camera_path_file.h"
#include "scene/text/json_numbers.h"
#include "scene_reader.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace trisoup;
  return fuzz::expect_result_or_error([&] {
    const nlohmann::json document =
        scene::parse_json(std::string_view(reinterpret_cast<const char*>(data), size), "fuzz");
    const nlohmann::json dataparser = document.is_object() ? document.value("dataparser", nlohmann::json()) : nullptr;
    const render::CameraPath path = render::read_camera_path(document, "fuzz", {}, dataparser);
    for (const double share : {0.0, 0.3, 0.9, 1.0}) {
      const scene::Camera camera = render::camera_of(render::shot_at(path.keys, share * path.seconds()), 64, 48);
      if (!(std::isfinite(glm::length(camera.centre())) && camera.fx > 0)) __builtin_trap();
    }
    if (render::picture_times(path, 1.0).empty()) __builtin_trap();
  });
}
