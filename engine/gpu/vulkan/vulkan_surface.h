// gpu::Surface on Vulkan: a swapchain whose images pictures are drawn on.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "gpu/graphics.h"
#include "gpu/vulkan/vulkan_device.h"

namespace trisoup::gpu {

class VulkanSurface final : public Surface {
 public:
  VulkanSurface(VulkanDevice& device, VulkanGraphics& graphics, std::function<std::uint64_t(void*)> create);
  ~VulkanSurface() override;
  VulkanSurface(const VulkanSurface&) = delete;
  VulkanSurface& operator=(const VulkanSurface&) = delete;

  const Image* next(std::uint32_t width, std::uint32_t height) override;
  bool show() override;

 private:
  void open();
  void close();
  void close_swapchain();
  /// False where the window has no area now, or its surface was lost.
  bool open_swapchain(std::uint32_t width, std::uint32_t height);
  /// False where the surface was lost or its swapchain no longer fits: the next picture opens another. Else as
  /// VulkanDevice::guard.
  bool stands(VkResult result, const char* call);

  VulkanDevice& device_;
  VulkanGraphics& graphics_;
  std::function<std::uint64_t(void*)> create_;
  VkSurfaceKHR surface_ = VK_NULL_HANDLE;
  VkSwapchainKHR swapchain_ = VK_NULL_HANDLE;
  VkExtent2D asked_{}, extent_{};
  std::vector<Image> images_;
  std::optional<std::uint32_t> held_;  // the image that is being drawn on
  std::vector<VkSemaphore> drawn_;     // per image: it may be presented
  VkSemaphore acquired_ = VK_NULL_HANDLE;
  bool lost_ = false, stale_ = false;  // the surface, the swapchain
};

}  // namespace trisoup::gpu
