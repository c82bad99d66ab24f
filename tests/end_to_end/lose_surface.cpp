// Preloaded into soup-view: every few calls the window's surface is lost or its swapchain out of date, as happens where
// a display server restarts, a laptop changes its graphics card, or a window moves to a monitor of another one. Says on
// exit how often.
#include <atomic>
#include <cstdio>

#include <dlfcn.h>
#include <vulkan/vulkan.h>

namespace {

std::atomic<int> acquired{0}, presented{0}, asked{0}, listed{0}, lost{0};

template <typename Function>
Function real(const char* name) {
  return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
}

struct Report {
  ~Report() {
    if (std::FILE* file = std::fopen("losses", "w")) {
      std::fprintf(file, "%d\n", lost.load());
      std::fclose(file);
    }
  }
} report;

}  // namespace

extern "C" {

VkResult vkAcquireNextImageKHR(VkDevice device, VkSwapchainKHR swapchain, uint64_t timeout, VkSemaphore semaphore,
                               VkFence fence, uint32_t* image) {
  const int n = ++acquired;
  if (n % 5 == 0) {
    ++lost;
    return n % 2 ? VK_ERROR_SURFACE_LOST_KHR : VK_ERROR_OUT_OF_DATE_KHR;
  }
  static const auto next = real<PFN_vkAcquireNextImageKHR>("vkAcquireNextImageKHR");
  return next(device, swapchain, timeout, semaphore, fence, image);
}

VkResult vkQueuePresentKHR(VkQueue queue, const VkPresentInfoKHR* info) {
  static const auto next = real<PFN_vkQueuePresentKHR>("vkQueuePresentKHR");
  // The semaphores are waited for whatever becomes of the picture.
  const VkResult result = next(queue, info);
  const int n = ++presented;
  if (n % 3 != 0) return result;
  ++lost;
  return n % 2 ? VK_ERROR_SURFACE_LOST_KHR : VK_ERROR_OUT_OF_DATE_KHR;
}

VkResult vkGetPhysicalDeviceSurfaceCapabilitiesKHR(VkPhysicalDevice physical, VkSurfaceKHR surface,
                                                   VkSurfaceCapabilitiesKHR* capabilities) {
  if (++asked % 4 == 0) {
    ++lost;
    return VK_ERROR_SURFACE_LOST_KHR;
  }
  static const auto next =
      real<PFN_vkGetPhysicalDeviceSurfaceCapabilitiesKHR>("vkGetPhysicalDeviceSurfaceCapabilitiesKHR");
  return next(physical, surface, capabilities);
}

VkResult vkGetPhysicalDeviceSurfaceFormatsKHR(VkPhysicalDevice physical, VkSurfaceKHR surface, uint32_t* count,
                                              VkSurfaceFormatKHR* formats) {
  if (++listed % 7 == 0) {
    ++lost;
    return VK_ERROR_SURFACE_LOST_KHR;
  }
  static const auto next = real<PFN_vkGetPhysicalDeviceSurfaceFormatsKHR>("vkGetPhysicalDeviceSurfaceFormatsKHR");
  return next(physical, surface, count, formats);
}

}  // extern "C"
