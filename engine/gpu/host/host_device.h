// gpu::Device without a graphics API: the kernels, compiled as C++, run on the threads of the CPU. For debugging
// kernels and for the sanitizers, and where there is no Vulkan at all. It cannot draw.
#pragma once

#include <memory>
#include <vector>

#include "gpu/device.h"

namespace trisoup::gpu {

std::vector<DeviceInfo> list_host_devices();
std::unique_ptr<Device> open_host_device(const DeviceOptions& options);

}  // namespace trisoup::gpu
