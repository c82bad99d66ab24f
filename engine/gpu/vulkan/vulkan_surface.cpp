#include "gpu/vulkan/vulkan_surface.h"

#include <algorithm>
#include <utility>

#include "base/error.h"
#include "gpu/vulkan/vulkan_graphics.h"

namespace trisoup::gpu {
namespace {

constexpr std::uint64_t kPatience = 100'000'000;  // timeout for acquiring an image, in ns

VkSwapchainCreateInfoKHR swapchain_info(VkSurfaceKHR surface, const VkSurfaceCapabilitiesKHR& can,
                                        const VkSurfaceFormatKHR& format, VkExtent2D extent) {
  auto info = structure<VkSwapchainCreateInfoKHR>(VK_STRUCTURE_TYPE_SWAPCHAIN_CREATE_INFO_KHR);
  info.surface = surface;
  info.minImageCount =
      can.maxImageCount > 0 ? std::min(can.minImageCount + 1, can.maxImageCount) : can.minImageCount + 1;
  info.imageFormat = format.format;
  info.imageColorSpace = format.colorSpace;
  info.imageExtent = extent;
  info.imageArrayLayers = 1;
  info.imageUsage = VK_IMAGE_USAGE_TRANSFER_DST_BIT | VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT;
  info.imageSharingMode = VK_SHARING_MODE_EXCLUSIVE;
  info.preTransform = can.supportedTransforms & VK_SURFACE_TRANSFORM_IDENTITY_BIT_KHR
                          ? VK_SURFACE_TRANSFORM_IDENTITY_BIT_KHR
                          : can.currentTransform;
  info.compositeAlpha = VK_COMPOSITE_ALPHA_OPAQUE_BIT_KHR;
  if (!(can.supportedCompositeAlpha & info.compositeAlpha)) info.compositeAlpha = VK_COMPOSITE_ALPHA_INHERIT_BIT_KHR;
  info.presentMode = VK_PRESENT_MODE_FIFO_KHR;
  info.clipped = VK_TRUE;
  return info;
}

}  // namespace

VulkanSurface::VulkanSurface(VulkanDevice& device, VulkanGraphics& graphics, std::function<std::uint64_t(void*)> create)
    : device_(device), graphics_(graphics), create_(std::move(create)) {
  auto semaphore = structure<VkSemaphoreCreateInfo>(VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO);
  check(vkCreateSemaphore(device_.device_, &semaphore, nullptr, &acquired_), "vkCreateSemaphore");
  try {
    open();
  } catch (...) {
    close();
    vkDestroySemaphore(device_.device_, acquired_, nullptr);
    throw;
  }
}

VulkanSurface::~VulkanSurface() {
  close();
  vkDestroySemaphore(device_.device_, acquired_, nullptr);
}

void VulkanSurface::open() {
  surface_ = reinterpret_cast<VkSurfaceKHR>(create_(device_.instance_->handle()));
  if (!surface_) throw Error("Vulkan: the window has no surface to draw on; run without a window");
  VkBool32 supported = VK_FALSE;
  if (!stands(vkGetPhysicalDeviceSurfaceSupportKHR(device_.physical_, device_.family_, surface_, &supported),
              "vkGetPhysicalDeviceSurfaceSupportKHR"))
    return;  // already lost; the next frame recreates it
  if (!supported)
    throw Error("Vulkan: {} cannot present to this window; choose another device with `device`", device_.info_.name);
}

void VulkanSurface::close() {
  close_swapchain();
  vkDestroySurfaceKHR(device_.instance_->handle(), surface_, nullptr);
  surface_ = VK_NULL_HANDLE;
}

void VulkanSurface::close_swapchain() {
  vkDeviceWaitIdle(device_.device_);
  for (VkSemaphore s : drawn_) vkDestroySemaphore(device_.device_, s, nullptr);
  drawn_.clear();
  held_.reset();
  images_.clear();
  vkDestroySwapchainKHR(device_.device_, swapchain_, nullptr);
  swapchain_ = VK_NULL_HANDLE;
}

bool VulkanSurface::stands(VkResult result, const char* call) {
  lost_ = lost_ || result == VK_ERROR_SURFACE_LOST_KHR;
  stale_ = stale_ || lost_ || result == VK_ERROR_OUT_OF_DATE_KHR;
  if (stale_) return false;
  device_.guard(result, call);
  return true;
}

std::optional<VkSurfaceFormatKHR> VulkanSurface::choose_format() {
  std::uint32_t count = 0;
  constexpr const char* kFormats = "vkGetPhysicalDeviceSurfaceFormatsKHR";
  if (!stands(vkGetPhysicalDeviceSurfaceFormatsKHR(device_.physical_, surface_, &count, nullptr), kFormats)) return {};
  std::vector<VkSurfaceFormatKHR> formats(count);
  if (!stands(vkGetPhysicalDeviceSurfaceFormatsKHR(device_.physical_, surface_, &count, formats.data()), kFormats))
    return {};
  // Accepts only UNORM formats: colours are already sRGB-encoded and must not be encoded again.
  const auto fits = [&](const VkSurfaceFormatKHR& f) {
    VkFormatProperties properties;
    vkGetPhysicalDeviceFormatProperties(device_.physical_, f.format, &properties);
    constexpr VkFormatFeatureFlags kNeeded =
        VK_FORMAT_FEATURE_BLIT_DST_BIT | VK_FORMAT_FEATURE_COLOR_ATTACHMENT_BLEND_BIT;
    return (properties.optimalTilingFeatures & kNeeded) == kNeeded &&
           f.colorSpace == VK_COLOR_SPACE_SRGB_NONLINEAR_KHR &&
           (f.format == VK_FORMAT_B8G8R8A8_UNORM || f.format == VK_FORMAT_R8G8B8A8_UNORM ||
            f.format == VK_FORMAT_A8B8G8R8_UNORM_PACK32 || f.format == VK_FORMAT_A2B10G10R10_UNORM_PACK32 ||
            f.format == VK_FORMAT_R5G6B5_UNORM_PACK16);
  };
  const auto found = std::find_if(formats.begin(), formats.end(), fits);
  if (found == formats.end())
    throw Error("Vulkan: this window does not support UNORM colour formats; choose another device with `device`");
  return *found;
}

bool VulkanSurface::open_swapchain(std::uint32_t width, std::uint32_t height) {
  close_swapchain();
  VkSurfaceCapabilitiesKHR can;
  stale_ = false;
  if (std::exchange(lost_, false)) {
    close();
    open();
    if (lost_) return false;
  }
  if (!stands(vkGetPhysicalDeviceSurfaceCapabilitiesKHR(device_.physical_, surface_, &can),
              "vkGetPhysicalDeviceSurfaceCapabilitiesKHR"))
    return false;
  extent_ = can.currentExtent;
  // Some window systems let the program choose the size.
  if (extent_.width == ~0u)
    extent_ = {std::clamp(width, can.minImageExtent.width, can.maxImageExtent.width),
               std::clamp(height, can.minImageExtent.height, can.maxImageExtent.height)};
  if (extent_.width == 0 || extent_.height == 0) return false;
  if (!(can.supportedUsageFlags & VK_IMAGE_USAGE_TRANSFER_DST_BIT))
    throw Error("Vulkan: {} cannot copy images to this window; choose another device with `device`",
                device_.info_.name);

  const std::optional<VkSurfaceFormatKHR> format = choose_format();
  if (!format) return false;
  const VkSwapchainCreateInfoKHR info = swapchain_info(surface_, can, *format, extent_);
  if (!stands(vkCreateSwapchainKHR(device_.device_, &info, nullptr, &swapchain_), "vkCreateSwapchainKHR")) {
    swapchain_ = VK_NULL_HANDLE;
    return false;
  }
  std::uint32_t count = 0;
  check(vkGetSwapchainImagesKHR(device_.device_, swapchain_, &count, nullptr), "vkGetSwapchainImagesKHR");
  std::vector<VkImage> images(count);
  check(vkGetSwapchainImagesKHR(device_.device_, swapchain_, &count, images.data()), "vkGetSwapchainImagesKHR");
  for (VkImage image : images) images_.push_back(graphics_.borrow(image, format->format, extent_));
  auto semaphore = structure<VkSemaphoreCreateInfo>(VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO);
  for (std::uint32_t i = 0; i < count; ++i)
    check(vkCreateSemaphore(device_.device_, &semaphore, nullptr, &drawn_.emplace_back()), "vkCreateSemaphore");
  asked_ = {width, height};
  return true;
}

const Image* VulkanSurface::next(std::uint32_t width, std::uint32_t height) {
  if (width == 0 || height == 0) return nullptr;
  const bool fits = swapchain_ && !stale_ && asked_.width == width && asked_.height == height;
  if (held_ && fits) return &images_[*held_];
  // Waits for the previous frame, so that its semaphores can be reused.
  device_.wait();
  if (!fits && !open_swapchain(width, height)) return nullptr;
  std::uint32_t index = 0;
  const VkResult result =
      vkAcquireNextImageKHR(device_.device_, swapchain_, kPatience, acquired_, VK_NULL_HANDLE, &index);
  // A hidden window may receive no image at all.
  if (result == VK_TIMEOUT || result == VK_NOT_READY) return nullptr;
  if (!stands(result, "vkAcquireNextImageKHR")) return nullptr;
  // All later submissions in the stream also wait for the acquired image.
  device_.begin();
  device_.submit(acquired_, VK_NULL_HANDLE);
  held_ = index;
  graphics_.stored(images_[index]).layout = VK_IMAGE_LAYOUT_UNDEFINED;
  return &images_[index];
}

bool VulkanSurface::show() {
  if (!held_) return false;
  const std::uint32_t index = *std::exchange(held_, std::nullopt);
  graphics_.move_to(graphics_.stored(images_[index]), VK_IMAGE_LAYOUT_PRESENT_SRC_KHR);
  device_.submit(VK_NULL_HANDLE, drawn_[index]);

  auto present = structure<VkPresentInfoKHR>(VK_STRUCTURE_TYPE_PRESENT_INFO_KHR);
  present.waitSemaphoreCount = 1;
  present.pWaitSemaphores = &drawn_[index];
  present.swapchainCount = 1;
  present.pSwapchains = &swapchain_;
  present.pImageIndices = &index;
  // VK_SUBOPTIMAL_KHR counts as success. A change of size arrives as a window event, and next() then gets the new size.
  return stands(vkQueuePresentKHR(device_.queue_, &present), "vkQueuePresentKHR");
}

}  // namespace trisoup::gpu
