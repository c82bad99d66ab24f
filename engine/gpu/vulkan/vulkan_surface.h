// gpu::Surface on Vulkan: draws directly to the images of a swapchain.
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
  /// Returns nullopt if the surface was lost. Throws Error if the window has no suitable format.
  std::optional<VkSurfaceFormatKHR> choose_format();
  /// Returns false if the window has no area at the moment or its surface was lost.
  bool open_swapchain(std::uint32_t width, std::uint32_t height);
  /// Returns false if the surface was lost or its swapchain is out of date; the next frame recreates it. Handles other
  /// results like VulkanDevice::guard.
  bool stands(VkResult result, const char* call);

  VulkanDevice& device_;
  VulkanGraphics& graphics_;
  std::function<std::uint64_t(void*)> create_;
  VkSurfaceKHR surface_ = VK_NULL_HANDLE;
  VkSwapchainKHR swapchain_ = VK_NULL_HANDLE;
  VkExtent2D asked_{}, extent_{};
  std::vector<Image> images_;
  std::optional<std::uint32_t> held_;  // index of the acquired image
  std::vector<VkSemaphore> drawn_;     // per image: signalled when it may be presented
  VkSemaphore acquired_ = VK_NULL_HANDLE;
  bool lost_ = false, stale_ = false;  // lost_: the surface was lost; stale_: the swapchain must be recreated
};

}  // namespace trisoup::gpu
