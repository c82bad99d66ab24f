// gpu::Device on Vulkan 1.3 with buffer device addresses.
#pragma once

#include <memory>
#include <vector>

#include "gpu/device.h"

namespace trisoup::gpu {

std::vector<DeviceInfo> list_vulkan_devices();
std::unique_ptr<Device> open_vulkan_device(const DeviceOptions& options);

}  // namespace trisoup::gpu
