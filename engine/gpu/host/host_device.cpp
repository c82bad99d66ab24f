#include "gpu/host/host_device.h"

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <map>
#include <mutex>
#include <string>
#include <thread>

#include <fmt/format.h>

#include "base/error.h"
#include "base/memory.h"
#include "gpu/compiled_kernels.h"
#include "gpu/host/workgroup.h"
#include "gpu/lanes/lane_kernels.h"
#include "gpu/out_of_memory.h"

namespace trisoup::gpu {
namespace {

using host::CompiledKernel;

/// Thread pool that runs the workgroups of a launch.
class Pool {
 public:
  Pool() {
    for (unsigned i = 1; i < std::max(1u, std::thread::hardware_concurrency()); ++i)
      threads_.emplace_back([this] { serve(); });
  }
  ~Pool() {
    {
      std::lock_guard lock(mutex_);
      stop_ = true;
    }
    wake_.notify_all();
    for (std::thread& thread : threads_) thread.join();
  }
  void run(const CompiledKernel& kernel, const std::byte* arguments, std::uint64_t groups) {
    {
      std::lock_guard lock(mutex_);
      kernel_ = &kernel;
      arguments_ = arguments;
      groups_ = groups;
      next_ = 0;
      busy_ = threads_.size();
      ++launch_;
    }
    wake_.notify_all();
    work(own_);
    std::unique_lock lock(mutex_);
    done_.wait(lock, [&] { return busy_ == 0; });
  }

 private:
  void work(host::Workgroup& workgroup) {
    for (std::uint64_t g; (g = next_.fetch_add(1, std::memory_order_relaxed)) < groups_;)
      workgroup.run(*kernel_, arguments_, static_cast<std::uint32_t>(g));
  }
  void serve() {
    host::Workgroup workgroup;
    std::uint64_t seen = 0;
    for (;;) {
      std::unique_lock lock(mutex_);
      wake_.wait(lock, [&] { return stop_ || launch_ != seen; });
      if (stop_) return;
      seen = launch_;
      lock.unlock();
      work(workgroup);
      lock.lock();
      if (--busy_ == 0) done_.notify_one();
    }
  }

  std::mutex mutex_;
  std::condition_variable wake_, done_;
  std::vector<std::thread> threads_;
  host::Workgroup own_;
  const CompiledKernel* kernel_ = nullptr;
  const std::byte* arguments_ = nullptr;
  std::uint64_t groups_ = 0, launch_ = 0;
  std::atomic<std::uint64_t> next_{0};
  std::size_t busy_ = 0;
  bool stop_ = false;
};

DeviceInfo describe(int index) {
  DeviceInfo info;
  info.index = index;
  info.backend = "cpu";
  info.name = "CPU";
  std::ifstream cpus("/proc/cpuinfo");
  for (std::string line; std::getline(cpus, line);)
    if (line.starts_with("model name") && line.find(": ") != std::string::npos) {
      info.name = line.substr(line.find(": ") + 2);
      break;
    }
  const host::LaneKernels& kernels = host::chosen_lane_kernels();
  info.driver = kernels.lanes > 1
                    ? fmt::format("kernels compiled as C++ for {} lanes of {}", kernels.lanes, kernels.instructions)
                    : "kernels compiled as C++";
  info.kind = Kind::cpu;
  const Memory memory = memory_of_machine();
  info.memory_bytes = memory.total;
  info.free_bytes = memory.available;
  info.subgroup_size = kernels.lanes;
  return info;
}

class HostDevice final : public Device {
 public:
  explicit HostDevice(const DeviceOptions& options) : info_(describe(0)), lose_after_(options.lose_after_launches) {
    ceiling_ = info_.free_bytes / 10 * 9;
  }
  const DeviceInfo& info() const override { return info_; }

  using Device::upload;
  void upload(Address to, std::span<const std::byte> bytes) override {
    if (!bytes.empty()) std::memcpy(memory(to, bytes.size()), bytes.data(), bytes.size());
  }
  void submit() override {}
  void wait() override {
    if (!lost_.empty())
      throw Error("{}: the device was lost while running kernel '{}'; continue from the last checkpoint with `resume`",
                  info_.name, lost_);
  }
  void enable_timings(bool on) override { timed_ = on; }
  std::map<std::string, KernelTiming> timings() override { return timings_; }
  void reset_timings() override { timings_.clear(); }
  std::vector<std::string> validation_messages() const override { return {}; }

 private:
  void read(Address from, std::span<std::byte> bytes) override {
    wait();
    if (!bytes.empty()) std::memcpy(bytes.data(), memory(from, bytes.size()), bytes.size());
  }
  void run(const CommandList::Fill& fill) override {
    std::fill_n(reinterpret_cast<std::uint32_t*>(memory(fill.to, fill.bytes)), fill.bytes / 4, fill.value);
  }
  void run(const CommandList::Copy& copy) override {
    std::memmove(memory(copy.to, copy.bytes), memory(copy.from, copy.bytes), copy.bytes);
  }
  void run(const CommandList::Launch& launch) override {
    // The error is reported at the next wait, as a graphics API does.
    if (lose_after_ > 0 && ++launches_ == lose_after_) lost_ = launch.kernel.name;
    if (!lost_.empty()) return;
    const CompiledKernel& found = find_compiled(std::span(kernels_.kernels), launch.kernel, launch.argument_bytes);
    const auto start = std::chrono::steady_clock::now();
    pool_.run(found, launch.arguments.data(), launch.groups);
    if (!timed_) return;
    KernelTiming& timing = timings_[launch.kernel.name];
    ++timing.launches;
    timing.milliseconds += std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  }
  Address allocate_raw(std::uint64_t bytes, std::string_view what) override {
    // Kernels with lanes may read up to 15 words before and after a buffer (lane_memory.h).
    void* memory = std::aligned_alloc(64, (bytes + 63) / 64 * 64 + 2 * kRoom);
    if (!memory)
      throw OutOfMemory(
          allocated_bytes(), allocated_bytes() - bytes,
          "memory: {} needs {} MB, more than is free; use fewer triangles or smaller photographs (`resolution`)", what,
          (bytes >> 20) + 1);
    return reinterpret_cast<Address>(memory) + kRoom;
  }
  void free_raw(Address address) override { std::free(reinterpret_cast<void*>(address - kRoom)); }
  std::byte* memory(Address address, std::uint64_t bytes) {
    find(address, bytes);
    return reinterpret_cast<std::byte*>(address);
  }

  static constexpr std::uint64_t kRoom = 64;  // bytes
  DeviceInfo info_;
  const host::LaneKernels& kernels_ = host::chosen_lane_kernels();
  Pool pool_;
  bool timed_ = false;
  std::map<std::string, KernelTiming> timings_;
  std::uint64_t lose_after_ = 0, launches_ = 0;
  std::string lost_;  // kernel that was running when the device was lost; empty: not lost
};

}  // namespace

std::vector<DeviceInfo> list_host_devices() { return {describe(0)}; }

std::unique_ptr<Device> open_host_device(const DeviceOptions& options) { return std::make_unique<HostDevice>(options); }

}  // namespace trisoup::gpu
