// Entry points of the Vulkan backend of gpu::Device.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "gpu/device.h"

namespace trisoup::gpu {

/// Returns the usable Vulkan devices; empty if there is no loader or no driver.
std::vector<DeviceInfo> list_vulkan_devices();
/// Throws Error if there is no such device.
std::unique_ptr<Device> open_vulkan_device(const DeviceOptions& options);

/// Number of VkInstances created by this process so far. Devices share them (vulkan_instance.h).
std::size_t vulkan_instances_made();

}  // namespace trisoup::gpu
