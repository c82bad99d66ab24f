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

/// A VkInstance with the validation layer, if that is asked for, and what the layer said. Only borrow_instance() makes
/// one.
class Instance {
 public:
  /// extensions: of the instance, by name, as the window library asks for them. Throws Error, which names the failed
  /// call.
  Instance(bool validation, const std::vector<std::string>& extensions);
  Instance(const Instance&) = delete;
  Instance& operator=(const Instance&) = delete;
  ~Instance();

  VkInstance handle() const { return instance_; }
  /// Throws Error where there is none.
  std::vector<VkPhysicalDevice> physical_devices() const;
  std::vector<std::string> messages();
  void forget_messages();
  bool draws_to_windows() const { return draws_to_windows_; }

 private:
  struct MessageLog {
    std::mutex mutex;
    std::vector<std::string> messages;
  };
  static VKAPI_ATTR VkBool32 VKAPI_CALL on_message(VkDebugUtilsMessageSeverityFlagBitsEXT,
                                                   VkDebugUtilsMessageTypeFlagsEXT,
                                                   const VkDebugUtilsMessengerCallbackDataEXT* data, void* user);

  MessageLog log_;
  VkInstance instance_ = VK_NULL_HANDLE;
  VkDebugUtilsMessengerEXT messenger_ = VK_NULL_HANDLE;
  bool draws_to_windows_ = false;
};

/// Gives the instance back for the next device; it is not destroyed.
struct GiveBack {
  void operator()(Instance* instance) const;
};
using BorrowedInstance = std::unique_ptr<Instance, GiveBack>;

/// An instance with these properties, made on first need and kept until the process ends: drivers limit how many
/// instances a process may make, and unloading them with the last instance is slow and not always safe. All devices
/// without validation share one instance for each list of extensions. With validation an instance belongs to one device
/// at a time, because the layer does not say which device a message is about; the next device gets it after it was
/// given back. Any thread may call this. Throws Error.
BorrowedInstance borrow_instance(bool validation, const std::vector<std::string>& extensions);

bool has_extension(VkPhysicalDevice device, const char* name);

/// The devices that can run the kernels, in the order of their indices.
std::vector<std::pair<VkPhysicalDevice, DeviceInfo>> usable_devices(const Instance& instance);

}  // namespace trisoup::gpu
