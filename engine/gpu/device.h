// The interface between the trainer and the compute backends: an in-order stream of kernels and copies.
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

enum class Kind { discrete, integrated, virtual_gpu, other, cpu };  // fastest first

struct DeviceInfo {
  int index = 0;        // position in the list that contains it: list_devices() or the list of one backend
  std::string backend;  // "vulkan", "cuda", "cpu"
  std::string name;     // as reported by the driver
  std::string driver;   // driver name and version
  Kind kind = Kind::other;
  std::uint64_t memory_bytes = 0;  // size of the largest device-local heap
  std::uint64_t free_bytes = 0;    // free part of it as reported by the driver; memory_bytes if not reported
  std::uint32_t subgroup_size = 0;
  double load_seconds = 0;  // time to load the kernels when the device was opened; CUDA only
};

/// Time spent in a kernel since Device::reset_timings(), from device timestamps.
struct KernelTiming {
  std::uint64_t launches = 0;
  double milliseconds = 0;
};

class Device;
class Graphics;

/// Device memory, freed by the destructor. The initial contents are undefined.
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

/// A device with one in-order stream: every command sees the writes of all earlier commands. Commands may run only
/// after submit(); download() and wait() submit too. Not thread-safe. Every call throws trisoup::Error if the device
/// fails. If the device is lost, the message names the kernel that was running.
class Device {
 public:
  virtual ~Device() = default;
  virtual const DeviceInfo& info() const = 0;

  /// Throws OutOfMemory if the allocation would exceed the ceiling or if the device is out of memory. `what` describes
  /// the contents in error messages.
  Buffer allocate(std::uint64_t bytes, std::string_view what);
  std::uint64_t allocated_bytes() const { return allocated_; }
  std::uint64_t peak_bytes() const { return peak_; }
  /// Limit of allocated_bytes(). Default: a backend's share of the free device memory.
  void set_ceiling(std::uint64_t bytes) { ceiling_ = bytes; }
  std::uint64_t ceiling() const { return ceiling_; }

  virtual void upload(Address to, std::span<const std::byte> bytes) = 0;  // copies the bytes before it returns
  void download(Address from, std::span<std::byte> bytes) {               // waits
    downloaded_ += bytes.size();
    read(from, bytes);
  }
  std::uint64_t downloaded_bytes() const { return downloaded_; }    // total of download() since the device was opened
  void fill(Address to, std::uint64_t bytes, std::uint32_t value);  // bytes: a multiple of 4
  void copy(Address to, Address from, std::uint64_t bytes);

  /// Runs `groups` workgroups. Kernels must use group_index() (shaders/common/kernel.h) for the number of the
  /// workgroup, because launches of more than 65,535 workgroups use two dimensions.
  template <typename Args>
  void launch(const Kernel& kernel, std::uint64_t groups, const Args& args) {
    static_assert(std::is_trivially_copyable_v<Args> && sizeof(Args) <= kMaxArgumentBytes);
    if (groups > 0) launch(kernel, groups, std::as_bytes(std::span(&args, 1)));
  }

  /// Ends a submission. Drivers abort submissions that run for several seconds, so long work needs cuts.
  void cut();

  /// Records the launches, fills, copies and cuts made by `commands` without running them. `commands` must not use the
  /// device in any other way.
  CommandList record(const std::function<void()>& commands);
  /// Submits earlier commands, then the segments of the list. A backend may translate the list at the first replay.
  /// Later replays take almost no host time.
  void replay(CommandList& list);

  virtual void submit() = 0;
  virtual void wait() = 0;

  /// The drawing interface (gpu/graphics.h); null if the backend or the device has no rasteriser.
  virtual Graphics* graphics() { return nullptr; }

  /// Turns kernel timing on or off. Timestamps slow the device a little. Default: off.
  virtual void enable_timings(bool on) = 0;
  virtual std::map<std::string, KernelTiming> timings() = 0;  // waits
  virtual void reset_timings() = 0;

  /// Returns the known resources of a workgroup of this kernel, or null if the backend does not have the kernel.
  /// Compiles the kernel if the backend has a compiler.
  virtual std::optional<KernelResources> kernel_resources(const Kernel& kernel) { return declared_resources(kernel); }

  /// Messages of the validation layers so far. Empty if the layers are off or reported nothing.
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
  virtual void run(const CommandList::Fill& fill) = 0;  // at least one word
  virtual void run(const CommandList::Copy& copy) = 0;  // at least one byte
  void run(const CommandList::Command& command) {
    std::visit([this](const auto& c) { run(c); }, command);
  }
  /// Runs the segments of a list for replay(). The default runs the commands one by one.
  virtual void run_list(CommandList& list);
  /// Allocates device memory after the bytes have been counted. Throws OutOfMemory.
  virtual Address allocate_raw(std::uint64_t bytes, std::string_view what) = 0;
  virtual void free_raw(Address address) = 0;

  /// Adds memory that is about to be allocated to allocated_bytes(). Throws OutOfMemory if the sum would exceed the
  /// ceiling.
  void count(std::uint64_t bytes, std::string_view what);
  void uncount(std::uint64_t bytes) { allocated_ -= bytes; }

  /// Returns the start of the buffer that contains these bytes, and their offset in it. Throws Error if no buffer
  /// contains them.
  std::pair<Address, std::uint64_t> find(Address address, std::uint64_t bytes) const;
  /// A number that changes with every allocation and release, after which an address may belong to another buffer.
  std::uint64_t generation() const { return generation_; }

  std::uint64_t ceiling_ = ~0ull;

 private:
  void launch(const Kernel& kernel, std::uint64_t groups, std::span<const std::byte> args);
  void give(CommandList::Command command);
  void release(Address address, std::uint64_t bytes);
  std::uint64_t allocated_ = 0, peak_ = 0, generation_ = 0, downloaded_ = 0;
  std::map<Address, std::uint64_t> buffers_;  // start and size in bytes
  CommandList* recorded_ = nullptr;           // list that is being recorded
};

struct DeviceOptions {
  std::string backend = "auto";  // auto (see choose_backend()), vulkan, cuda, cpu
  /// Number in list_devices(), part of a device name, or name of a backend; empty: the fastest kind of device.
  std::string device = {};
  bool draws = false;  // the device must have a rasteriser (Device::graphics())
  /// Vulkan instance extensions that the window library needs; empty: no windows.
  std::vector<std::string> window_extensions = {};
  bool validation = false;         // Khronos validation layer, core and synchronisation
  bool kernel_statistics = false;  // Vulkan: kernel_resources() queries the driver, which may recompile kernels for it
  std::uint64_t lose_after_launches = 0;  // fault injection for tests: report a lost device at this launch; 0: never
};

/// Returns all usable devices, numbered from 0: the devices of Vulkan, then those of CUDA, then the CPU.
std::vector<DeviceInfo> list_devices();

/// Resolves the backend "auto" for these devices: a GPU through Vulkan, else a GPU through CUDA, else the "cpu"
/// backend, which takes less than half the time of a Vulkan driver for the CPU (docs/benchmarks.md). Drawing, windows
/// and validation always need Vulkan. If options.device is set, open_device() takes the backend from choose_device()
/// instead.
std::string choose_backend(const DeviceOptions& options, const std::vector<DeviceInfo>& devices);

/// Finds the device that options.device describes in `devices`, a list as returned by list_devices(): by number, by
/// part of a name (case-insensitive) or by name of a backend. If several match, returns the first of the fastest kind.
/// Considers only devices that fit options.backend and the requested features. Returns null if none matches.
const DeviceInfo* choose_device(const DeviceOptions& options, const std::vector<DeviceInfo>& devices);

/// Opens the device that fits the options. Throws Error if none fits.
std::unique_ptr<Device> open_device(const DeviceOptions& options);

/// Returns a one-line note if loading the kernels took more than a second, else an empty string.
std::string slow_load_note(const DeviceInfo& device);

const char* to_string(Kind kind);

}  // namespace trisoup::gpu
