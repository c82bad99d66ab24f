// Fuzzes the reader of transforms.json, and undistortion of a small image with the lens in the file.
#include <string_view>

#include "scene/formats/transforms_json.h"
#include "scene/lens/panorama.h"
#include "scene/lens/undistort.h"
#include "scene_reader.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace trisoup;
  return fuzz::expect_result_or_error([&] {
    const std::string_view text(reinterpret_cast<const char*>(data), size);
    scene::Findings findings;
    for (const scene::TransformsFrame& frame : scene::parse_transforms(text, "fuzz", findings).frames) {
      const scene::Camera camera = scene::resized(scene::camera_of(frame, {4, 3}), 4, 3);
      const scene::Photograph photograph{4, 3, std::vector<glm::u8vec4>(12), {}};
      if (!frame.lens.is_panorama())
        scene::undistort(photograph, camera, frame.lens);
      else if (camera.cx > 0 && camera.cx < 4 && camera.cy > 0 && camera.cy < 3)  // as check_intrinsics() demands
        scene::cut_face(photograph, camera, 0);
    }
  });
}
