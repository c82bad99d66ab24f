#include "gpu/device.h"

#include <algorithm>
#include <cstring>

#include "error.h"
#include "gpu/cuda/cuda_backend.h"
#include "gpu/host/host_device.h"
#include "gpu/out_of_memory.h"
#include "gpu/vulkan/vulkan_backend.h"

namespace trisoup::gpu {

Buffer::~Buffer() {
  if (device_) device_->release(address_, bytes_);
}

void Device::count(std::uint64_t bytes, std::string_view what) {
  if (allocated_ + bytes > ceiling_)
    throw OutOfMemory(allocated_ + bytes, ceiling_,
                      "device memory: {} needs {} MB, {} of {} MB are left; use fewer triangles, a lower resolution (-r) or --memory",
                      what, (bytes >> 20) + 1, (ceiling_ - allocated_) >> 20, ceiling_ >> 20);
  allocated_ += bytes;
  peak_ = std::max(peak_, allocated_);
}

Buffer Device::allocate(std::uint64_t bytes, std::string_view what) {
  // Odd sizes would make fills and 8-byte loads at the end of a buffer illegal.
  bytes = std::max<std::uint64_t>(16, (bytes + 15) / 16 * 16);
  count(bytes, what);
  try {
    const Address address = allocate_raw(bytes, what);
    buffers_[address] = bytes;
    ++generation_;
    return Buffer(*this, address, bytes);
  } catch (...) {
    uncount(bytes);
    throw;
  }
}

void Device::release(Address address, std::uint64_t bytes) {
  uncount(bytes);
  buffers_.erase(address);
  ++generation_;
  free_raw(address);
}

std::pair<Address, std::uint64_t> Device::find(Address address, std::uint64_t bytes) const {
  const auto after = buffers_.upper_bound(address);
  if (after != buffers_.begin()) {
    const auto& [start, size] = *std::prev(after);
    if (address - start <= size && bytes <= size - (address - start)) return {start, address - start};
  }
  throw Error("gpu: {} bytes at {:#x} lie outside every buffer", bytes, address);
}

void Device::launch(const Kernel& kernel, std::uint64_t groups, std::span<const std::byte> args) {
  CommandList::Launch launch{kernel, groups, args.size(), {}};
  std::memcpy(launch.arguments.data(), args.data(), args.size());
  give(std::move(launch));
}

void Device::fill(Address to, std::uint64_t bytes, std::uint32_t value) {
  if (bytes > 0) give(CommandList::Fill{to, bytes, value});
}

void Device::copy(Address to, Address from, std::uint64_t bytes) {
  if (bytes > 0) give(CommandList::Copy{to, from, bytes});
}

void Device::give(CommandList::Command command) {
  if (recorded_) recorded_->segments.back().push_back(std::move(command));
  else run(command);
}

void Device::cut() {
  if (!recorded_) submit();
  else if (!recorded_->segments.back().empty()) recorded_->segments.emplace_back();
}

CommandList Device::record(const std::function<void()>& commands) {
  CommandList list;
  list.segments.emplace_back();
  recorded_ = &list;
  try {
    commands();
  } catch (...) {
    recorded_ = nullptr;
    throw;
  }
  recorded_ = nullptr;
  if (list.segments.back().empty()) list.segments.pop_back();
  return list;
}

void Device::replay(CommandList& list) {
  submit();
  run_list(list);
}

void Device::run_list(CommandList& list) {
  for (const CommandList::Segment& segment : list.segments) {
    for (const CommandList::Command& command : segment) run(command);
    submit();
  }
}

std::vector<DeviceInfo> list_devices() {
  std::vector<DeviceInfo> devices = list_vulkan_devices();
  for (DeviceInfo& device : list_cuda_devices()) devices.push_back(std::move(device));
  for (DeviceInfo& device : list_host_devices()) devices.push_back(std::move(device));
  return devices;
}

namespace {

bool needs_vulkan(const DeviceOptions& options) {
  return options.draws || options.validation || !options.device.empty() || !options.window_extensions.empty();
}

bool has_gpu(std::string_view backend, const std::vector<DeviceInfo>& devices) {
  return std::ranges::any_of(devices, [&](const DeviceInfo& d) { return d.backend == backend && d.kind != Kind::cpu; });
}

/// What choose_backend() has to know, and no more: looking for devices takes a while, and where Vulkan has one a broken CUDA is nobody's business.
std::vector<DeviceInfo> devices_in_question(const DeviceOptions& options) {
  if (options.backend != "auto" || needs_vulkan(options)) return {};
  std::vector<DeviceInfo> devices = list_vulkan_devices();
  if (has_gpu("vulkan", devices)) return devices;
  try {
    for (DeviceInfo& device : list_cuda_devices()) devices.push_back(std::move(device));
  } catch (const Error&) {
    // --backend cuda says what is wrong with it.
  }
  return devices;
}

}  // namespace

std::string choose_backend(const DeviceOptions& options, const std::vector<DeviceInfo>& devices) {
  if (options.backend != "auto") return options.backend;
  if (needs_vulkan(options)) return "vulkan";
  return has_gpu("vulkan", devices) ? "vulkan" : has_gpu("cuda", devices) ? "cuda" : "cpu";
}

std::unique_ptr<Device> open_device(const DeviceOptions& options) {
  const std::string backend = choose_backend(options, devices_in_question(options));
  if (backend == "vulkan") return open_vulkan_device(options);
  if (backend == "cuda") return open_cuda_device(options);
  if (backend == "cpu" && !options.device.empty())
    throw Error("--device {}: --backend cpu has no devices to choose from; leave out one of the two", options.device);
  if (backend == "cpu") return open_host_device(options);
  throw Error("--backend {}: this program has no such backend; use auto, vulkan, cuda or cpu", options.backend);
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
