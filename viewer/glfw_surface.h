// Where GLFW's windows and the device meet: the one file of the viewer that names a graphics API.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "gpu/graphics.h"

struct GLFWwindow;

namespace trisoup::viewer {

/// For DeviceOptions::window_extensions. Throws Error where GLFW finds no Vulkan.
std::vector<std::string> window_extensions();

/// Throws Error.
std::unique_ptr<gpu::Surface> open_surface(gpu::Device& gpu, GLFWwindow* window);

}  // namespace trisoup::viewer
