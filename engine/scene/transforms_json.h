// transforms*.json: cameras of NeRF-Synthetic (Blender), instant-ngp and nerfstudio.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <glm/glm.hpp>

#include "image/image_file.h"
#include "scene/camera.h"
#include "scene/lens.h"

namespace trisoup::scene {

struct TransformsFrame {
  std::string file_path;  // as written: relative to the file, perhaps without extension
  std::string mask_path;  // empty: none
  glm::dmat4 world_to_camera{1.0};
  ImageSize size;                                          // that the intrinsics are for; 0 x 0: that of the photograph
  std::optional<double> fx, fy, cx, cy, angle_x, angle_y;  // pixels; radians over the whole width and height
  Lens lens;
};

struct Transforms {
  std::vector<TransformsFrame> frames;
  std::string ply_file_path;                                    // empty: none
  std::vector<std::string> train_files, val_files, test_files;  // nerfstudio's split, by file_path; usually empty
};

/// Reads the text of a transforms file; `name` stands in messages. Intrinsics of a frame win over those of the file,
/// focal lengths over angles. Throws Error on malformed JSON (with its line), missing or mistyped keys, poses that are
/// no rotation, focal lengths that are not positive, and unknown camera models.
Transforms parse_transforms(std::string_view text, const std::string& name);

/// The pinhole part of a frame's camera, for images of the size that the frame states, else of `photograph`'s size. A
/// missing principal point is the centre; one focal length stands for both.
Camera camera_of(const TransformsFrame& frame, ImageSize photograph);

}  // namespace trisoup::scene
