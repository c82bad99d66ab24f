// The CUDA backend of gpu::Device. If nvcc is not found at build time, cuda_absent.cpp replaces it.
#pragma once

#include <memory>
#include <vector>

#include "gpu/device.h"

namespace trisoup::gpu {

/// Returns the CUDA devices; empty if there is no NVIDIA driver or no device.
std::vector<DeviceInfo> list_cuda_devices();
/// Throws Error if there is no such device or the program was built without CUDA.
std::unique_ptr<Device> open_cuda_device(const DeviceOptions& options);

}  // namespace trisoup::gpu
