// The one interface between the trainer and a graphics API: an in-order stream of kernels and copies.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "gpu/command_list.h"
#include "gpu/kernel_resources.h"

namespace trisoup::gpu {

enum class Kind { discrete, integrated, virtual_gpu, other, cpu };  // the fastest first

struct DeviceInfo {
  int index = 0;        // what --device takes: in list_devices() among all, in a backend's own list among its own
  std::string backend;  // "vulkan", "cuda", "cpu"
  std::string name;     // as the driver says it
  std::string driver;   // driver and its version
  Kind kind = Kind::other;
  std::uint64_t memory_bytes = 0;  // of the largest device-local heap
  std::uint64_t free_bytes = 0;    // what the driver says is free in it; memory_bytes where it does not say
  std::uint32_t subgroup_size = 0;
  double load_seconds = 0;  // that loading the kernels took when the device was opened; CUDA only
};

/// Time that a kernel took, from device timestamps, since Device::reset_timings().
struct KernelTiming {
  std::uint64_t launches = 0;
  double milliseconds = 0;
};

class Device;
class Graphics;

/// Device memory; freed with the object. Contents start undefined.
class Buffer {
 public:
  Buffer() = default;
  Buffer(Device& device, Address address, std::uint64_t bytes) : device_(&device), address_(address), bytes_(bytes) {}
  Buffer(Buffer&& other) noexcept { swap(other); }
  Buffer& operator=(Buffer&& other) noexcept {
    Buffer taken(std::move(other));
    swap(taken);
    return *this;
  }
  ~Buffer();
  Address address() const { return address_; }
  std::uint64_t bytes() const { return bytes_; }
  explicit operator bool() const { return device_ != nullptr; }

 private:
  void swap(Buffer& other) {
    std::swap(device_, other.device_);
    std::swap(address_, other.address_);
    std::swap(bytes_, other.bytes_);
  }
  Device* device_ = nullptr;
  Address address_ = 0;
  std::uint64_t bytes_ = 0;
};

/// In-order stream: every command sees the writes of the one before it. Nothing runs before submit() (download() and
/// wait() submit by themselves). Not thread-safe. Every call throws trisoup::Error when the device fails; when it is
/// lost, the message names the kernel that was running.
class Device {
 public:
  virtual ~Device() = default;
  virtual const DeviceInfo& info() const = 0;

  /// Throws OutOfMemory when `bytes` would pass the ceiling or the device has no more; `what` names the contents for
  /// people.
  Buffer allocate(std::uint64_t bytes, std::string_view what);
  std::uint64_t allocated_bytes() const { return allocated_; }
  std::uint64_t peak_bytes() const { return peak_; }
  /// Bytes that allocate() never passes. Default: what is free on the device.
  void set_ceiling(std::uint64_t bytes) { ceiling_ = bytes; }
  std::uint64_t ceiling() const { return ceiling_; }

  virtual void upload(Address to, std::span<const std::byte> bytes) = 0;  // the bytes are copied before it returns
  void download(Address from, std::span<std::byte> bytes) {               // waits
    downloaded_ += bytes.size();
    read(from, bytes);
  }
  std::uint64_t downloaded_bytes() const { return downloaded_; }    // by download(), since the device was opened
  void fill(Address to, std::uint64_t bytes, std::uint32_t value);  // bytes: a multiple of 4
  void copy(Address to, Address from, std::uint64_t bytes);

  /// Runs `groups` workgroups. Kernels number them with group_index() (shaders/common/kernel.h), since one dimension of
  /// a launch may hold no more than 65,535.
  template <typename Args>
  void launch(const Kernel& kernel, std::uint64_t groups, const Args& args) {
    static_assert(std::is_trivially_copyable_v<Args> && sizeof(Args) <= kMaxArgumentBytes);
    if (groups > 0) launch(kernel, groups, std::as_bytes(std::span(&args, 1)));
  }

  /// Where a submission ends, so that none keeps the device for long: drivers kill what runs for seconds.
  void cut();

  /// The launches, fills, copies and cuts that `commands` asks for; none of them is run. It may do nothing else with
  /// the device.
  CommandList record(const std::function<void()>& commands);
  /// Submits what was given before, then the segments of the list. The first time a backend may translate the list;
  /// after that the host has next to nothing to do.
  void replay(CommandList& list);

  virtual void submit() = 0;
  virtual void wait() = 0;

  /// For drawing (gpu/graphics.h); null where the backend or the device has no rasteriser.
  virtual Graphics* graphics() { return nullptr; }

  /// Kernel times need timestamps on the device and cost a little; off at the start.
  virtual void enable_timings(bool on) = 0;
  virtual std::map<std::string, KernelTiming> timings() = 0;  // waits
  virtual void reset_timings() = 0;

  /// What a workgroup of this kernel takes, as far as it is known; compiles the kernel if the backend has a compiler.
  /// Null if the backend does not have this kernel.
  virtual std::optional<KernelResources> kernel_resources(const Kernel& kernel) { return declared_resources(kernel); }

  /// Messages of the validation layers so far; empty when they are off or content.
  virtual std::vector<std::string> validation_messages() const = 0;

  template <typename T>
  void upload(Address to, const std::vector<T>& values) {
    upload(to, std::as_bytes(std::span(values)));
  }
  template <typename T>
  std::vector<T> download_vector(Address from, std::size_t count) {
    std::vector<T> values(count);
    download(from, std::as_writable_bytes(std::span(values)));
    return values;
  }

 protected:
  friend class Buffer;
  virtual void read(Address from, std::span<std::byte> bytes) = 0;
  virtual void run(const CommandList::Launch& launch) = 0;
  virtual void run(const CommandList::Fill& fill) = 0;  // of at least one word
  virtual void run(const CommandList::Copy& copy) = 0;  // of at least one byte
  void run(const CommandList::Command& command) {
    std::visit([this](const auto& c) { run(c); }, command);
  }
  /// replay() where there is nothing better: one command after the other.
  virtual void run_list(CommandList& list);
  /// The bytes have been counted. Throws OutOfMemory.
  virtual Address allocate_raw(std::uint64_t bytes, std::string_view what) = 0;
  virtual void free_raw(Address address) = 0;

  /// Counts memory that is about to be taken or was given back. Throws OutOfMemory when it would pass the ceiling.
  void count(std::uint64_t bytes, std::string_view what);
  void uncount(std::uint64_t bytes) { allocated_ -= bytes; }

  /// Start of the buffer that holds these bytes, and where in it they begin. Throws Error where none does.
  std::pair<Address, std::uint64_t> find(Address address, std::uint64_t bytes) const;
  /// Changes whenever memory is taken or given back: addresses may mean other buffers then.
  std::uint64_t generation() const { return generation_; }

  std::uint64_t ceiling_ = ~0ull;

 private:
  void launch(const Kernel& kernel, std::uint64_t groups, std::span<const std::byte> args);
  void give(CommandList::Command command);
  void release(Address address, std::uint64_t bytes);
  std::uint64_t allocated_ = 0, peak_ = 0, generation_ = 0, downloaded_ = 0;
  std::map<Address, std::uint64_t> buffers_;  // and their bytes
  CommandList* recorded_ = nullptr;           // takes commands in place of the device
};

struct DeviceOptions {
  std::string backend = "auto";  // auto (see choose_backend()), vulkan, cuda, cpu
  std::string device =
      {};              // number in list_devices(), a part of a name or a backend's; empty: the fastest kind there is
  bool draws = false;  // the device has to have a rasteriser (Device::graphics())
  std::vector<std::string> window_extensions = {};  // what the window library needs of the instance; empty: no windows
  bool validation = false;                          // Khronos validation layer, core and synchronisation
  bool kernel_statistics = false;  // Vulkan: kernel_resources() asks the driver, which may compile kernels anew for it
  std::uint64_t lose_after_launches = 0;  // fault injection for tests: report a lost device at this launch; 0: never
};

/// Every usable device, numbered from 0 on: those of Vulkan, of CUDA, the CPU. Empty when there is none.
std::vector<DeviceInfo> list_devices();

/// What the backend "auto" stands for where these devices are: a GPU through Vulkan, else through CUDA, else the CPU's
/// own threads, which take less than half the time of a Vulkan driver for the CPU (docs/benchmarks.md). Vulkan whatever
/// there is where something is asked for that it alone has: drawing, windows, validation. Not asked where a device is.
std::string choose_backend(const DeviceOptions& options, const std::vector<DeviceInfo>& devices);

/// The one of `devices`, as list_devices() has them, that options.device means: its number, a part of its name in
/// capitals or not, or the name of its backend; of several the first of the fastest kind. Only one of options.backend,
/// and only one that has what is asked for. Null where there is none.
const DeviceInfo* choose_device(const DeviceOptions& options, const std::vector<DeviceInfo>& devices);

/// Throws Error when no device fits.
std::unique_ptr<Device> open_device(const DeviceOptions& options);

/// One line if loading the kernels took more than a second; else empty.
std::string slow_load_note(const DeviceInfo& device);

const char* to_string(Kind kind);

}  // namespace trisoup::gpu
