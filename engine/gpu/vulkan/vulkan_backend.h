// gpu::Device on Vulkan 1.3 with buffer device addresses.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "gpu/device.h"

namespace trisoup::gpu {

std::vector<DeviceInfo> list_vulkan_devices();
std::unique_ptr<Device> open_vulkan_device(const DeviceOptions& options);

/// VkInstances that this process has made so far. Devices share them (vulkan_instance.h).
std::size_t vulkan_instances_made();

}  // namespace trisoup::gpu
