#include "gpu/device.h"

#include <algorithm>
#include <charconv>
#include <cstring>

#include <fmt/format.h>

#include "base/cancellation.h"
#include "base/error.h"
#include "base/printable.h"
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
                      "device memory: {} needs {} MB, {} of {} MB are left; use fewer triangles, smaller photographs "
                      "(`resolution`) or a higher limit (`memory`)",
                      what, (bytes >> 20) + 1, (ceiling_ - allocated_) >> 20, ceiling_ >> 20);
  allocated_ += bytes;
  peak_ = std::max(peak_, allocated_);
}

Buffer Device::allocate(std::uint64_t bytes, std::string_view what) {
  // Sizes that are not multiples of 16 could make fills and 8-byte loads at the end of a buffer illegal.
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
  throw Error("device memory: {} bytes at {:#x} are outside all buffers; report this as a bug", bytes, address);
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
  if (recorded_) {
    recorded_->segments.back().push_back(std::move(command));
    return;
  }
  check_cancellation();
  run(command);
}

void Device::cut() {
  if (!recorded_)
    submit();
  else if (!recorded_->segments.back().empty())
    recorded_->segments.emplace_back();
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

namespace {

/// careful: throw Error if CUDA fails, instead of leaving its devices out.
std::vector<DeviceInfo> all_devices(bool careful) {
  std::vector<DeviceInfo> devices = list_vulkan_devices();
  try {
    for (DeviceInfo& device : list_cuda_devices()) devices.push_back(std::move(device));
  } catch (const Error&) {
    if (careful) throw;
  }
  for (DeviceInfo& device : list_host_devices()) devices.push_back(std::move(device));
  for (std::size_t i = 0; i < devices.size(); ++i) devices[i].index = static_cast<int>(i);
  return devices;
}

std::string lower(std::string text) {
  for (char& c : text)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return text;
}

}  // namespace

std::vector<DeviceInfo> list_devices() { return all_devices(true); }

namespace {

bool needs_vulkan(const DeviceOptions& options) {
  return options.draws || options.validation || !options.window_extensions.empty();
}

bool has_gpu(std::string_view backend, const std::vector<DeviceInfo>& devices) {
  return std::ranges::any_of(devices, [&](const DeviceInfo& d) { return d.backend == backend && d.kind != Kind::cpu; });
}

/// Lists only the devices that choose_backend() needs. Enumeration takes time, and a CUDA failure does not matter if
/// Vulkan has a GPU.
std::vector<DeviceInfo> devices_in_question(const DeviceOptions& options) {
  if (options.backend != "auto" || needs_vulkan(options)) return {};
  std::vector<DeviceInfo> devices = list_vulkan_devices();
  if (has_gpu("vulkan", devices)) return devices;
  try {
    for (DeviceInfo& device : list_cuda_devices()) devices.push_back(std::move(device));
  } catch (const Error&) {
    // The error is reported if the CUDA backend is chosen explicitly.
  }
  return devices;
}

}  // namespace

std::string choose_backend(const DeviceOptions& options, const std::vector<DeviceInfo>& devices) {
  if (options.backend != "auto") return options.backend;
  if (needs_vulkan(options)) return "vulkan";
  return has_gpu("vulkan", devices) ? "vulkan" : has_gpu("cuda", devices) ? "cuda" : "cpu";
}

const DeviceInfo* choose_device(const DeviceOptions& options, const std::vector<DeviceInfo>& devices) {
  const std::string wanted = lower(options.device);
  int index = -1;
  const char* end = options.device.data() + options.device.size();
  const auto [rest, problem] = std::from_chars(options.device.data(), end, index);
  const bool is_number = rest == end && problem == std::errc();
  const DeviceInfo* chosen = nullptr;
  for (const DeviceInfo& d : devices) {
    if (options.backend != "auto" ? d.backend != options.backend : needs_vulkan(options) && d.backend != "vulkan")
      continue;
    const bool fits =
        is_number ? d.index == index : d.backend == wanted || lower(d.name).find(wanted) != std::string::npos;
    if (fits && (!chosen || d.kind < chosen->kind)) chosen = &d;
  }
  return chosen;
}

namespace {

/// Resolves options.device to a backend and a number within that backend.
DeviceOptions with_backend(DeviceOptions options) {
  const std::vector<DeviceInfo> devices = all_devices(options.backend == "cuda");
  const DeviceInfo* const chosen = choose_device(options, devices);
  if (!chosen)
    throw Error("`device` {}: there is no such device{}; `list_devices` prints the devices", printable(options.device),
                options.backend != "auto" ? " of `backend` " + options.backend
                : needs_vulkan(options)   ? " in Vulkan"
                                          : "");
  const auto before = std::ranges::count_if(
      devices, [&](const DeviceInfo& d) { return d.backend == chosen->backend && d.index < chosen->index; });
  options.backend = chosen->backend;
  options.device = std::to_string(before);
  return options;
}

bool is_backend(const std::string& name) {
  return name == "auto" || name == "vulkan" || name == "cuda" || name == "cpu";
}

}  // namespace

std::unique_ptr<Device> open_device(const DeviceOptions& given) {
  const DeviceOptions options = given.device.empty() || !is_backend(given.backend) ? given : with_backend(given);
  const std::string backend = choose_backend(options, devices_in_question(options));
  if (backend == "vulkan") return open_vulkan_device(options);
  if (backend == "cuda") return open_cuda_device(options);
  if (backend == "cpu") return open_host_device(options);
  throw Error("`backend` {}: there is no such backend; use auto, vulkan, cuda or cpu", options.backend);
}

std::string slow_load_note(const DeviceInfo& device) {
  if (device.load_seconds <= 1) return "";
  return fmt::format(
      "loading the kernels took {:.1f} s; if the program has no code for this card, the driver compiles PTX at the "
      "first start and caches the result",
      device.load_seconds);
}

const char* to_string(Kind kind) {
  switch (kind) {
    case Kind::discrete:
      return "discrete GPU";
    case Kind::integrated:
      return "integrated GPU";
    case Kind::virtual_gpu:
      return "virtual GPU";
    case Kind::cpu:
      return "CPU";
    case Kind::other:
      break;
  }
  return "other";
}

}  // namespace trisoup::gpu
