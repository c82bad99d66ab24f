// gpu::Device on CUDA. Built where nvcc is found; elsewhere cuda_absent.cpp says so.
#pragma once

#include <memory>
#include <vector>

#include "gpu/device.h"

namespace trisoup::gpu {

/// Empty where there is no NVIDIA driver or no device.
std::vector<DeviceInfo> list_cuda_devices();
/// Throws Error where there is no such device, or CUDA was left out of this program.
std::unique_ptr<Device> open_cuda_device(const DeviceOptions& options);

}  // namespace trisoup::gpu
