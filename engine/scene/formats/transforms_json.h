// Reader for transforms*.json: cameras of NeRF-Synthetic (Blender), instant-ngp and nerfstudio.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <glm/glm.hpp>

#include "image/image_file.h"
#include "scene/camera.h"
#include "scene/formats/transforms_intrinsics.h"
#include "scene/lens/lens.h"
#include "scene/text/findings.h"

namespace trisoup::scene {

struct TransformsFrame {
  std::string file_path;   // as written: relative to the file, possibly without extension
  std::string mask_path;   // empty: none
  std::string depth_path;  // empty: none
  glm::dmat4 world_to_camera{1.0};
  ImageSize size;  // image size of the intrinsics; 0: size of the photograph
  TransformsIntrinsics intrinsics;
  Lens lens;
};

struct Transforms {
  std::vector<TransformsFrame> frames;
  std::string ply_file_path;                                    // empty: none
  double depth_unit = 0;                                        // of depth maps, units of the poses; 0: not given
  std::vector<std::string> train_files, val_files, test_files;  // nerfstudio's split, by file_path; usually empty
};

/// Reads the text of a transforms file. name: the file, for messages. Intrinsics of a frame have priority over those of
/// the file, and focal lengths over angles. NaN and Infinity, which Python writes, count as numbers. Leaves out frames
/// with missing keys, keys of the wrong type, values that are not finite, poses that are not a rotation and a
/// translation, and intrinsics or lenses that cannot be used (see read_intrinsics and read_lens). Throws Error if no
/// frame is left, and for malformed JSON (with the line).
Transforms parse_transforms(std::string_view text, const std::string& name, Findings& findings);

/// Returns the pinhole part of a frame's camera for the image size in the frame, or the size of `photograph` if there
/// is none. A missing principal point becomes the image centre. If only one focal length is given, it is used for both
/// axes.
/// A panorama has pixels per radian instead of focal lengths.
Camera camera_of(const TransformsFrame& frame, ImageSize photograph);

/// Returns what is wrong with a frame that claims to be a panorama: a focal length, and other proportions than 2 : 1.
/// Empty: nothing. instant-ngp and nerfstudio write focal lengths beside whole panoramas. camera: from camera_of().
std::string panorama_problem(const TransformsFrame& frame, const Camera& camera);

}  // namespace trisoup::scene
