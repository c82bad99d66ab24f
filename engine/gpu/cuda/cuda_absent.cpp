// What a program without CUDA says of it.
#include "base/error.h"
#include "gpu/cuda/cuda_backend.h"

namespace trisoup::gpu {

std::vector<DeviceInfo> list_cuda_devices() { return {}; }

std::unique_ptr<Device> open_cuda_device(const DeviceOptions&) {
  throw Error("--backend cuda: this program was built without CUDA; build it where nvcc is, or use vulkan or cpu");
}

}  // namespace trisoup::gpu
