// The cameras in a model.glb's extension (docs/formats.md).
#pragma once

#include <span>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "format/model_parts.h"
#include "scene/camera.h"

namespace trisoup::soup {

/// A camera of a training or test view, in normalised coordinates.
struct ModelCamera {
  std::string name;  // name of its photograph, UTF-8
  bool test = false;
  scene::Camera camera;
};

/// Cameras in file form. `poses` has seven floats per camera; its bufferView must be added to the JSON as "poses".
struct CodedCameras {
  nlohmann::json json;
  std::vector<float> poses;
};

/// Throws Error if read_cameras would refuse a camera of the file: a focal length or a position beyond the limits, or a
/// value that is not finite. The message begins with the name of the photograph.
void check_cameras(std::span<const ModelCamera> cameras);

/// Encodes cameras. world_to_camera must be a rotation and a translation. It is restored within 1e-7.
CodedCameras code_cameras(std::span<const ModelCamera> cameras);

/// Reads the cameras of a file of any version. Throws Error if a camera is not valid and nlohmann::json::exception if
/// the JSON has another structure.
std::vector<ModelCamera> read_cameras(const ModelParts& parts, const nlohmann::json& cameras);

}  // namespace trisoup::soup
