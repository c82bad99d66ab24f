// Reads and writes camera paths, as web/path.js: the JSON of web pages and nerfstudio's (web/tri-soup.d.ts describes
// both).
#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "render/camera_path.h"
#include "scene/normalisation.h"

namespace trisoup::render {

/// Throws Error if a camera is so far from the scene that floats cannot resolve it. eye: normalised; given: as the file
/// has it; place: where in the file.
void refuse_far_eye(const glm::dvec3& eye, const glm::dvec3& given, const std::string& place);

struct PathContext {
  scene::Normalisation normalisation;  // of the model
  glm::dvec3 up{0, 1, 0};              // of the scene, for key frames without one
  double fov = 0.7, aspect = 1;        // of key frames without them; fov: vertical, radians
};

/// Reads a path. document: from scene::parse_json. name: of its file, for messages. dataparser: contents of
/// nerfstudio's dataparser_transforms.json, which takes its coordinates to the dataset's; null: they are the dataset's.
/// Throws Error that names the key frame if it is no path.
CameraPath read_camera_path(const nlohmann::json& document, const std::string& name, const PathContext& context,
                            const nlohmann::json& dataparser = nullptr);

/// Returns the path as JSON of web pages, in dataset coordinates: key frames with time, matrix, fov and aspect.
nlohmann::json write_camera_path(const CameraPath& path, const scene::Normalisation& normalisation);

}  // namespace trisoup::render
