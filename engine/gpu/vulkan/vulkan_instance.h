// The Vulkan instance, and which of its devices will do.
#pragma once

#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "gpu/device.h"
#include "gpu/vulkan/vulkan_call.h"

namespace trisoup::gpu {

/// Shared memory that a workgroup of ours may take, in bytes.
inline constexpr std::uint32_t kSharedMemoryBytes = 32768;

/// A VkInstance with the validation layer, if that is asked for, and what the layer said.
class Instance {
 public:
  /// extensions: of the instance, by name, as the window library asks for them. Throws Error.
  Instance(bool validation, const std::vector<std::string>& extensions);
  Instance(const Instance&) = delete;
  Instance& operator=(const Instance&) = delete;
  ~Instance();

  VkInstance handle() const { return instance_; }
  std::vector<VkPhysicalDevice> physical_devices() const;
  std::vector<std::string> messages();
  bool draws_to_windows() const { return draws_to_windows_; }

 private:
  struct MessageLog {
    std::mutex mutex;
    std::vector<std::string> messages;
  };
  static VKAPI_ATTR VkBool32 VKAPI_CALL on_message(VkDebugUtilsMessageSeverityFlagBitsEXT, VkDebugUtilsMessageTypeFlagsEXT,
                                                   const VkDebugUtilsMessengerCallbackDataEXT* data, void* user);

  MessageLog log_;
  VkInstance instance_ = VK_NULL_HANDLE;
  VkDebugUtilsMessengerEXT messenger_ = VK_NULL_HANDLE;
  bool draws_to_windows_ = false;
};

bool has_extension(VkPhysicalDevice device, const char* name);

/// The devices that can run the kernels, in the order of their indices.
std::vector<std::pair<VkPhysicalDevice, DeviceInfo>> usable_devices(const Instance& instance);

}  // namespace trisoup::gpu
