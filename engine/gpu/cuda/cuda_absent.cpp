// The CUDA backend of a program built without CUDA.
#include "base/error.h"
#include "gpu/cuda/cuda_backend.h"

namespace trisoup::gpu {

std::vector<DeviceInfo> list_cuda_devices() { return {}; }

std::unique_ptr<Device> open_cuda_device(const DeviceOptions&) {
  throw Error(
      "`backend` cuda: this program was built without CUDA; build it with nvcc installed, or use vulkan or cpu");
}

}  // namespace trisoup::gpu
