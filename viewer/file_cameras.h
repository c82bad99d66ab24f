// The cameras of a file, for pictures without a window.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include <glm/glm.hpp>

#include "render/camera_path.h"
#include "subject.h"

namespace trisoup::viewer {

struct FileCameras {
  std::vector<scene::Camera> cameras;  // at least one; normalised coordinates of the model
  double fps = 30;
  bool distorted = false;  // some have a lens whose distortion pictures lack
};

struct FileCameraOptions {
  std::filesystem::path dataparser;  // nerfstudio's dataparser_transforms.json; empty: none
  std::optional<glm::ivec2> size;    // of the pictures, instead of the file's
  std::optional<double> fps;         // instead of the file's
};

/// Whether a file is JSON with a camera path, not a transforms.json or another file. Throws Error if it is damaged
/// JSON.
bool is_camera_path(const std::filesystem::path& path);

/// Reads a camera path of web pages or of nerfstudio, in dataset coordinates. Throws Error if it is none.
render::CameraPath read_path(const Subject& subject, const std::filesystem::path& path,
                             const std::filesystem::path& dataparser = {});

/// Reads a camera path of web pages, one of nerfstudio, or a transforms.json, in dataset coordinates. Pictures of paths
/// without a size have 720 rows. Lenses are without distortion. Throws Error if the file has no cameras.
FileCameras read_file_cameras(const Subject& subject, const std::filesystem::path& path,
                              const FileCameraOptions& options);

}  // namespace trisoup::viewer
