#include "api/impl.h"

namespace trisoup {

Device::Device(const std::string& backend, const std::string& name) : impl_(std::make_unique<Impl>()) {
  gpu::DeviceOptions options;
  options.backend = backend;
  options.device = name;
  impl_->device = gpu::open_device(options);
}

Device::Device(Device&&) noexcept = default;
Device& Device::operator=(Device&&) noexcept = default;
Device::~Device() = default;

std::string Device::name() const { return impl_->device->info().name; }

}  // namespace trisoup
