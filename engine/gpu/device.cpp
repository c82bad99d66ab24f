#include "gpu/device.h"

#include <algorithm>

#include "error.h"
#include "gpu/cuda/cuda_backend.h"
#include "gpu/host/host_device.h"
#include "gpu/vulkan/vulkan_backend.h"

namespace trisoup::gpu {

Buffer::~Buffer() {
  if (device_) device_->release(address_, bytes_);
}

void Device::count(std::uint64_t bytes, std::string_view what) {
  if (allocated_ + bytes > ceiling_)
    throw Error("device memory: {} needs {} MB, {} of {} MB are left; use fewer triangles, a lower resolution (-r) or --memory",
                what, (bytes >> 20) + 1, (ceiling_ - allocated_) >> 20, ceiling_ >> 20);
  allocated_ += bytes;
  peak_ = std::max(peak_, allocated_);
}

Buffer Device::allocate(std::uint64_t bytes, std::string_view what) {
  // Odd sizes would make fills and 8-byte loads at the end of a buffer illegal.
  bytes = std::max<std::uint64_t>(16, (bytes + 15) / 16 * 16);
  count(bytes, what);
  try {
    return Buffer(*this, allocate_raw(bytes, what), bytes);
  } catch (...) {
    uncount(bytes);
    throw;
  }
}

void Device::release(Address address, std::uint64_t bytes) {
  uncount(bytes);
  free_raw(address);
}

std::vector<DeviceInfo> list_devices() {
  std::vector<DeviceInfo> devices = list_vulkan_devices();
  for (DeviceInfo& device : list_cuda_devices()) devices.push_back(std::move(device));
  for (DeviceInfo& device : list_host_devices()) devices.push_back(std::move(device));
  return devices;
}

std::unique_ptr<Device> open_device(const DeviceOptions& options) {
  if (options.backend == "cuda") return open_cuda_device(options);
  if (options.backend == "cpu") return open_host_device(options);
  if (options.backend != "auto" && options.backend != "vulkan")
    throw Error("--backend {}: this program has no such backend; use auto, vulkan, cuda or cpu", options.backend);
  return open_vulkan_device(options);
}

const char* to_string(Kind kind) {
  switch (kind) {
    case Kind::discrete: return "discrete GPU";
    case Kind::integrated: return "integrated GPU";
    case Kind::virtual_gpu: return "virtual GPU";
    case Kind::cpu: return "CPU";
    case Kind::other: break;
  }
  return "other";
}

}  // namespace trisoup::gpu
