// soup-view's command line.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include <glm/glm.hpp>

#include "gpu/device.h"
#include "render/renderer.h"

namespace trisoup::viewer {

struct CommandLine {
  std::string model;    // empty: the window opens without one
  std::string dataset;  // for photographs and cameras; empty: the model's own cameras
  std::optional<std::string> screenshot, path, output, camera, json;
  bool benchmark = false, serve = false, list_devices = false;
  int port = 8000;                 // of --serve
  std::optional<glm::ivec2> size;  // pixels
  int frames = 120;
  std::optional<double> elevation;       // degrees
  std::optional<double> fov, near, far;  // degrees; normalised units
  std::optional<glm::vec3> background, up;
  render::DrawOptions draw;
  std::optional<render::AntiAliasing> aa;  // none given: what suits the device
  gpu::DeviceOptions device{.draws = true};
};

/// nullopt: the program is to end with `exit_code` (after --help, or after an error that has been printed).
std::optional<CommandLine> parse(int argc, char** argv, int& exit_code);

}  // namespace trisoup::viewer
