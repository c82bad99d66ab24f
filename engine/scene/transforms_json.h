// Reader for transforms*.json: cameras of NeRF-Synthetic (Blender), instant-ngp and nerfstudio.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <glm/glm.hpp>

#include "image/image_file.h"
#include "scene/camera.h"
#include "scene/findings.h"
#include "scene/lens.h"
#include "scene/transforms_intrinsics.h"

namespace trisoup::scene {

struct TransformsFrame {
  std::string file_path;  // as written: relative to the file, possibly without extension
  std::string mask_path;  // empty: none
  glm::dmat4 world_to_camera{1.0};
  ImageSize size;  // image size of the intrinsics; 0: size of the photograph
  TransformsIntrinsics intrinsics;
  Lens lens;
  std::string problem;  // why the camera of the frame cannot be used, without the file's name; empty: usable
};

struct Transforms {
  std::vector<TransformsFrame> frames;
  std::string ply_file_path;                                    // empty: none
  std::vector<std::string> train_files, val_files, test_files;  // nerfstudio's split, by file_path; usually empty
  Findings findings;                                            // keys that are not used
  std::string first_problem;                                    // of a frame, as a complete line
};

/// Reads the text of a transforms file. name: the file, for messages. Intrinsics of a frame have priority over those of
/// the file, and focal lengths over angles. Throws Error for malformed JSON (with the line), missing keys, keys of the
/// wrong type, and poses that are not a rotation and a translation. Intrinsics and lenses that cannot be used (see
/// read_intrinsics and read_lens) become the `problem` of a frame, or an Error if no frame is usable.
Transforms parse_transforms(std::string_view text, const std::string& name);

/// Returns the pinhole part of a frame's camera for the image size in the frame, or the size of `photograph` if there
/// is none. A missing principal point becomes the image centre. If only one focal length is given, it is used for both
/// axes.
/// A panorama has pixels per radian instead of focal lengths.
Camera camera_of(const TransformsFrame& frame, ImageSize photograph);

/// Returns what is wrong with a frame that claims to be a panorama: a focal length, and other proportions than 2 : 1.
/// Empty: nothing. instant-ngp and nerfstudio write focal lengths beside whole panoramas. camera: from camera_of().
std::string panorama_problem(const TransformsFrame& frame, const Camera& camera);

}  // namespace trisoup::scene
