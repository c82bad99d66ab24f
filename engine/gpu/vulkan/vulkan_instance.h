// The Vulkan instance and its usable devices.
#pragma once

#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "gpu/device.h"
#include "gpu/vulkan/vulkan_call.h"

namespace trisoup::gpu {

/// Limit of the shared memory of a workgroup in all kernels, in bytes. Usable devices have at least this much.
inline constexpr std::uint32_t kSharedMemoryBytes = 32768;

/// A VkInstance, optionally with the validation layer and its messages. Created only by borrow_instance().
class Instance {
 public:
  /// extensions: names of the instance extensions that the window library needs. Throws Error that names the failed
  /// call.
  Instance(bool validation, const std::vector<std::string>& extensions);
  Instance(const Instance&) = delete;
  Instance& operator=(const Instance&) = delete;
  ~Instance();

  VkInstance handle() const { return instance_; }
  /// Throws Error if there is none.
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

/// Deleter that returns the instance for use by the next device instead of destroying it.
struct GiveBack {
  void operator()(Instance* instance) const;
};
using BorrowedInstance = std::unique_ptr<Instance, GiveBack>;

/// Returns an instance with these properties. Instances are created on demand and kept until the process ends, because
/// drivers limit the number of instances per process, and unloading a driver with its last instance is slow and not
/// always safe. Without validation, all devices with the same extensions share one instance. With validation, an
/// instance belongs to one device at a time, because messages of the layer do not identify the device; it is reused
/// after it is returned. Thread-safe. Throws Error.
BorrowedInstance borrow_instance(bool validation, const std::vector<std::string>& extensions);

bool has_extension(VkPhysicalDevice device, const char* name);

/// Returns the devices that can run the kernels, ordered by index.
std::vector<std::pair<VkPhysicalDevice, DeviceInfo>> usable_devices(const Instance& instance);

}  // namespace trisoup::gpu
