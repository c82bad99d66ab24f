// The cameras in a model.glb's extension (docs/formats.md).
#pragma once

#include <span>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "format/model_parts.h"
#include "scene/camera.h"
#include "soup/soup.h"

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

/// Gains of exposures in file form, 75 floats per camera, NaN without an exposure of its name; empty if none has
/// one.
std::vector<float> code_exposures(std::span<const ModelCamera> cameras, std::span<const PhotographExposure> exposures);

/// The exposures of a file's cameras. Throws Error if their number differs from the cameras', or if one is not a number
/// or too large.
std::vector<PhotographExposure> read_exposures(const ModelParts& parts, const nlohmann::json& json,
                                               std::span<const ModelCamera> cameras);

/// The camera as it will be read from a file, with its pose rounded.
scene::Camera as_stored(const scene::Camera& camera);

/// What an exposure says of a camera besides its gain.
PhotographExposure exposure_at(std::string name, const scene::Camera& camera);

/// Reads the cameras of a file of any version. Throws Error if a camera is not valid and nlohmann::json::exception if
/// the JSON has another structure.
std::vector<ModelCamera> read_cameras(const ModelParts& parts, const nlohmann::json& cameras);

}  // namespace trisoup::soup
