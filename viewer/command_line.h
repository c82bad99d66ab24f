// The command line of soup-view.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <glm/glm.hpp>

#include "cli/serve_options.h"
#include "gpu/device.h"
#include "render/pixel_data.h"
#include "render/renderer.h"

namespace trisoup::viewer {

struct CommandLine {
  std::string model;    // empty: the window opens without a model
  std::string dataset;  // source of photographs and cameras; empty: the model's cameras
  std::optional<std::string> screenshot, path, output, camera, json, cameras, video;
  std::vector<render::PixelData> data;  // written beside each picture
  bool exr = false;                     // as one OpenEXR file instead of .npy files
  bool transparent = false;             // --background none
  std::string dataparser;               // of nerfstudio; empty: none
  bool benchmark = false, list_devices = false;
  ServeOptions serving;
  std::optional<glm::ivec2> size;  // pixels
  std::optional<int> frames;
  std::optional<double> elevation;       // degrees
  std::optional<double> fps;             // pictures per second
  std::optional<double> fov, near, far;  // degrees; normalised units
  std::optional<glm::vec3> background, up;
  render::DrawOptions draw;
  std::optional<render::AntiAliasing> aa;  // nullopt: chosen by device
  gpu::DeviceOptions device{.draws = true};
};

/// Returns nullopt after --help or an error, which it has printed; the program then exits with `exit_code`.
std::optional<CommandLine> parse(int argc, char** argv, int& exit_code);

}  // namespace trisoup::viewer
