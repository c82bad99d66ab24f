// Vulkan surfaces of GLFW windows. Only glfw_surface.cpp uses the Vulkan API in the viewer.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "gpu/graphics.h"

struct GLFWwindow;

namespace trisoup::viewer {

/// Value of DeviceOptions::window_extensions. Throws Error if GLFW finds no Vulkan.
std::vector<std::string> window_extensions();

/// Throws Error if no surface can be created.
std::unique_ptr<gpu::Surface> open_surface(gpu::Device& gpu, GLFWwindow* window);

}  // namespace trisoup::viewer
