#include <unistd.h>

#include <atomic>
#include <map>
#include <utility>

#include "api/impl.h"
#include "base/error.h"

namespace trisoup {

namespace {

/// The process that opened a GPU. Drivers have threads and locks that a fork of it lacks; its calls could wait for
/// ever.
std::atomic<pid_t> opened_a_gpu{0};

}  // namespace

Device::Device(const std::string& backend, const std::string& name) : impl_(std::make_shared<Impl>()) {
  if (const pid_t process = opened_a_gpu; backend != "cpu" && process != 0 && process != getpid())
    throw Error(
        "device: a GPU was opened before this process was forked, and drivers do not survive that; use "
        "`backend` cpu, or start processes without fork");
  gpu::DeviceOptions options;
  options.backend = backend;
  options.device = name;
  impl_->device = gpu::open_device(options);
  if (impl_->device->info().backend != "cpu") opened_a_gpu = getpid();
}

Device Device::shared(const std::string& backend) {
  // Never destroyed: a driver may be gone before static objects are. After a fork the child has none of the threads
  // that a device needs, so it opens its own.
  static std::mutex& guard = *new std::mutex;
  static auto& devices = *new std::map<std::pair<pid_t, std::string>, Device>;
  const std::lock_guard lock(guard);
  const std::pair<pid_t, std::string> key(getpid(), backend);
  const auto found = devices.find(key);
  return found != devices.end() ? found->second : devices.emplace(key, Device(backend)).first->second;
}

Device::Impl::~Impl() {
  if (!of_another_process()) return;
  for (auto& [key, loaded] : models) static_cast<void>(loaded.release());
  static_cast<void>(device.release());
}

namespace {

std::recursive_mutex& usable_guard(Device::Impl& device) {
  if (device.of_another_process())
    throw Error(
        "device: was opened before this process was forked; open a Device after the fork, or start processes "
        "without fork");
  return device.guard;
}

}  // namespace

DeviceLock::DeviceLock(const Device& device) : impl_(device.impl()), lock_(usable_guard(*impl_)) {}

std::string Device::name() const { return impl_->device->info().name; }
std::string Device::backend() const { return impl_->device->info().backend; }

}  // namespace trisoup
