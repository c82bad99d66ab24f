// The "cpu" backend of gpu::Device: kernels compiled as C++ run on the threads of the CPU. Used on machines without a
// GPU, for debugging kernels and for sanitizers. It cannot draw.
#pragma once

#include <memory>
#include <vector>

#include "gpu/device.h"

namespace trisoup::gpu {

std::vector<DeviceInfo> list_host_devices();
std::unique_ptr<Device> open_host_device(const DeviceOptions& options);

}  // namespace trisoup::gpu
