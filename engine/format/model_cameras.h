// The cameras of a model.glb, in its extension (docs/formats.md).
#pragma once

#include <span>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "format/model_parts.h"
#include "scene/camera.h"

namespace trisoup::soup {

/// A camera that the model was trained or tested with, in normalised coordinates.
struct ModelCamera {
  std::string name;  // of its photograph, UTF-8
  bool test = false;
  scene::Camera camera;
};

/// What a file says of cameras: JSON but for their poses, seven floats each, whose bufferView the JSON lacks under
/// "poses".
struct CodedCameras {
  nlohmann::json json;
  std::vector<float> poses;
};

/// world_to_camera is a rotation and a translation, as scene::Camera has it; it comes back 1e-7 off at most.
CodedCameras code_cameras(std::span<const ModelCamera> cameras);

/// Cameras of a file of any version. Throws Error on impossible ones, nlohmann::json::exception where the JSON is
/// something else.
std::vector<ModelCamera> read_cameras(const ModelParts& parts, const nlohmann::json& cameras);

}  // namespace trisoup::soup
