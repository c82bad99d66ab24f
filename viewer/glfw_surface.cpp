#include "glfw_surface.h"

#include <cstdint>

#define GLFW_INCLUDE_VULKAN
#include <GLFW/glfw3.h>

#include "base/error.h"

namespace trisoup::viewer {

std::vector<std::string> window_extensions() {
  std::uint32_t count = 0;
  const char** names = glfwGetRequiredInstanceExtensions(&count);
  if (!names) throw Error("this display does not support Vulkan; run without a window, see --help");
  return {names, names + count};
}

std::unique_ptr<gpu::Surface> open_surface(gpu::Device& gpu, GLFWwindow* window) {
  return gpu::graphics_of(gpu).open_surface([window](void* instance) -> std::uint64_t {
    VkSurfaceKHR surface = VK_NULL_HANDLE;
    if (glfwCreateWindowSurface(static_cast<VkInstance>(instance), window, nullptr, &surface) != VK_SUCCESS) return 0;
    return reinterpret_cast<std::uint64_t>(surface);
  });
}

}  // namespace trisoup::viewer
