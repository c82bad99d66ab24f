#include <algorithm>
#include <charconv>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <map>
#include <string>
#include <vector>

#include <cuda_runtime.h>
#include <fmt/format.h>

#include "base/error.h"
#include "gpu/compiled_kernels.h"
#include "gpu/cuda/cuda_backend.h"
#include "gpu/cuda/small_writes.h"
#include "gpu/out_of_memory.h"

namespace trisoup::gpu {
namespace {

using cuda::SmallWrite;

DeviceInfo describe(int index) {
  cudaDeviceProp properties{};
  int driver = 0, runtime = 0;
  if (cudaGetDeviceProperties(&properties, index) != cudaSuccess || cudaDriverGetVersion(&driver) != cudaSuccess ||
      cudaRuntimeGetVersion(&runtime) != cudaSuccess)
    throw Error("CUDA: device {} cannot be asked what it is ({})", index, cudaGetErrorString(cudaGetLastError()));
  DeviceInfo info;
  info.index = index;
  info.backend = "cuda";
  info.name = properties.name;
  info.driver = fmt::format("driver for CUDA {}.{}, runtime {}.{}", driver / 1000, driver % 1000 / 10, runtime / 1000,
                            runtime % 1000 / 10);
  info.kind = properties.integrated ? Kind::integrated : Kind::discrete;
  info.memory_bytes = info.free_bytes = properties.totalGlobalMem;
  info.subgroup_size = static_cast<std::uint32_t>(properties.warpSize);
  return info;
}

/// 0 where there is no driver.
int count_devices() {
  int count = 0;
  if (cudaGetDeviceCount(&count) != cudaSuccess) {
    cudaGetLastError();  // or the next call would report it again
    return 0;
  }
  return count;
}

class CudaDevice final : public Device {
 public:
  CudaDevice(int index, const DeviceOptions& options)
      : info_(describe(index)), lose_after_(options.lose_after_launches) {
    load_kernels(index);
    std::size_t free = 0, total = 0;
    check(cudaMemGetInfo(&free, &total), "cudaMemGetInfo");
    info_.free_bytes = free;
    // A tenth is left to the rest of the desktop and to the driver.
    ceiling_ = free / 10 * 9;
    check(cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking), "cudaStreamCreateWithFlags");
  }
  ~CudaDevice() override {
    // What goes wrong here can be told to nobody, and has been told before.
    cudaStreamSynchronize(stream_);
    for (const Timed& t : timed_) {
      cudaEventDestroy(t.start);
      cudaEventDestroy(t.end);
    }
    cudaStreamDestroy(stream_);
  }
  const DeviceInfo& info() const override { return info_; }

  using Device::upload;
  void upload(Address to, std::span<const std::byte> bytes) override {
    if (bytes.empty()) return;
    void* target = memory(to, bytes.size());
    if (bytes.size() <= 4 * SmallWrite::kMostWords && bytes.size() % 4 == 0) {
      SmallWrite write;
      std::memcpy(write.words.data(), bytes.data(), bytes.size());
      write.count = static_cast<std::uint32_t>(bytes.size() / 4);
      cuda::write_small(stream_, static_cast<std::uint32_t*>(target), write);
      check(cudaGetLastError(), "launch of a small write");
      return;
    }
    // From pageable memory: the bytes have been taken when the call returns.
    check(cudaMemcpyAsync(target, bytes.data(), bytes.size(), cudaMemcpyHostToDevice, stream_),
          "cudaMemcpyAsync to the device");
  }
  void submit() override {}  // a stream begins by itself
  void wait() override {
    if (!lost_.empty())
      throw Error("{}: the device was lost while running kernel '{}'; train on from the last checkpoint with --resume",
                  info_.name, lost_);
    check(cudaStreamSynchronize(stream_), "cudaStreamSynchronize");
    since_wait_.clear();
  }
  void enable_timings(bool on) override { timing_ = on; }
  std::map<std::string, KernelTiming> timings() override {
    wait();
    for (const Timed& t : std::exchange(timed_, {})) {
      float ms = 0;
      check(cudaEventElapsedTime(&ms, t.start, t.end), "cudaEventElapsedTime");
      cudaEventDestroy(t.start);
      cudaEventDestroy(t.end);
      KernelTiming& timing = timings_[t.kernel];
      ++timing.launches;
      timing.milliseconds += ms;
    }
    return timings_;
  }
  void reset_timings() override {
    timings();
    timings_.clear();
  }
  std::optional<KernelResources> kernel_resources(const Kernel& kernel) override {
    const std::vector<cuda::CompiledKernel>& all = cuda::compiled_kernels();
    if (std::ranges::none_of(all, [&](const cuda::CompiledKernel& k) { return k.name == kernel.name; }))
      return std::nullopt;
    const cuda::CompiledKernel& found = find_compiled(std::span(all), kernel, 0);
    cudaFuncAttributes attributes{};
    check(cudaFuncGetAttributes(&attributes, found.function), "cudaFuncGetAttributes");
    int groups = 0;
    check(cudaOccupancyMaxActiveBlocksPerMultiprocessor(&groups, found.function, static_cast<int>(found.threads), 0),
          "cudaOccupancyMaxActiveBlocksPerMultiprocessor");
    KernelResources resources;
    resources.threads = found.threads;
    resources.shared_bytes = static_cast<std::uint32_t>(attributes.sharedSizeBytes);
    resources.registers = static_cast<std::uint32_t>(attributes.numRegs);
    resources.local_bytes = static_cast<std::uint32_t>(attributes.localSizeBytes);
    resources.groups = static_cast<std::uint32_t>(groups);
    return resources;
  }
  std::vector<std::string> validation_messages() const override { return {}; }

 private:
  /// Makes the device's context and loads all kernels. The runtime would load each when it is first launched, and its
  /// module with it. If the program has only PTX for this card, the driver would then compile for seconds in the middle
  /// of a step. Asking for its attributes loads a kernel without running it.
  void load_kernels(int index) {
    using Clock = std::chrono::steady_clock;
    auto start = Clock::now();
    check(cudaSetDevice(index), "cudaSetDevice");
    // The context takes its own time, which is no compiler's; with EAGER, modules are loaded with it.
    const char* const loading = std::getenv("CUDA_MODULE_LOADING");
    if (!loading || std::string_view(loading) != "EAGER") start = Clock::now();
    for (const cuda::CompiledKernel& kernel : cuda::compiled_kernels()) {
      cudaFuncAttributes attributes{};
      check(cudaFuncGetAttributes(&attributes, kernel.function),
            fmt::format("cudaFuncGetAttributes of kernel '{}'", kernel.name));
    }
    info_.load_seconds = std::chrono::duration<double>(Clock::now() - start).count();
  }

  struct Timed {
    std::string kernel;
    cudaEvent_t start, end;
  };

  /// A segment as a graph: one call in place of one for every command.
  struct Graphs final : CommandList::Prepared {
    explicit Graphs(std::uint64_t of) : generation(of) {}
    ~Graphs() override {
      for (cudaGraphExec_t graph : graphs) cudaGraphExecDestroy(graph);  // one that still runs is kept until it ends
    }
    std::uint64_t generation;  // of the device's memory
    std::vector<cudaGraphExec_t> graphs;
  };

  void run_list(CommandList& list) override {
    // Events in a graph time its last run alone, and an injected fault counts launches.
    if (timing_ || lose_after_ > 0) return Device::run_list(list);
    auto* ready = static_cast<Graphs*>(list.prepared.get());
    if (!ready || ready->generation != generation()) {
      auto made = std::make_unique<Graphs>(generation());
      for (const CommandList::Segment& segment : list.segments) made->graphs.push_back(capture(segment));
      ready = made.get();
      list.prepared = std::move(made);
    }
    for (std::size_t i = 0; i < list.segments.size(); ++i) {
      for (const CommandList::Command& command : list.segments[i])
        if (const auto* launch = std::get_if<CommandList::Launch>(&command)) remember(launch->kernel.name);
      check(cudaGraphLaunch(ready->graphs[i], stream_), "cudaGraphLaunch");
    }
  }

  cudaGraphExec_t capture(const CommandList::Segment& segment) {
    // Relaxed: a kernel may be loaded when it is first launched, and nothing that is run here is unsafe otherwise.
    check(cudaStreamBeginCapture(stream_, cudaStreamCaptureModeRelaxed), "cudaStreamBeginCapture");
    cudaGraph_t graph = nullptr;
    try {
      for (const CommandList::Command& command : segment) Device::run(command);
    } catch (...) {
      // The stream has to leave its capture whatever was wrong.
      cudaStreamEndCapture(stream_, &graph);
      if (graph) cudaGraphDestroy(graph);
      throw;
    }
    check(cudaStreamEndCapture(stream_, &graph), "cudaStreamEndCapture");
    cudaGraphExec_t ready = nullptr;
    const cudaError_t result = cudaGraphInstantiate(&ready, graph, 0);
    cudaGraphDestroy(graph);
    check(result, "cudaGraphInstantiate");
    return ready;
  }

  void read(Address from, std::span<std::byte> bytes) override {
    if (!bytes.empty())
      check(cudaMemcpyAsync(bytes.data(), memory(from, bytes.size()), bytes.size(), cudaMemcpyDeviceToHost, stream_),
            "cudaMemcpyAsync to the host");
    wait();
  }
  void run(const CommandList::Fill& fill) override {
    void* target = memory(fill.to, fill.bytes);
    if (fill.value == 0) {
      check(cudaMemsetAsync(target, 0, fill.bytes, stream_), "cudaMemsetAsync");
      return;
    }
    cuda::fill_words(stream_, static_cast<std::uint32_t*>(target), fill.bytes / 4, fill.value);
    check(cudaGetLastError(), "launch of a fill");
  }
  void run(const CommandList::Copy& copy) override {
    check(cudaMemcpyAsync(memory(copy.to, copy.bytes), memory(copy.from, copy.bytes), copy.bytes,
                          cudaMemcpyDeviceToDevice, stream_),
          "cudaMemcpyAsync on the device");
  }
  void run(const CommandList::Launch& launch) override {
    const char* name = launch.kernel.name;
    if (lose_after_ > 0 && ++launches_ == lose_after_) lost_ = name;
    if (!lost_.empty()) return;
    const cuda::CompiledKernel& found =
        find_compiled(std::span(cuda::compiled_kernels()), launch.kernel, launch.argument_bytes);
    if (launch.groups > 0x7fffffffu)
      throw Error("{}: {} workgroups are more than a launch may have", name, launch.groups);
    remember(name);
    Timed timed{name, nullptr, nullptr};
    if (timing_) {
      check(cudaEventCreate(&timed.start), "cudaEventCreate");
      check(cudaEventCreate(&timed.end), "cudaEventCreate");
      check(cudaEventRecord(timed.start, stream_), "cudaEventRecord");
    }
    found.run(stream_, static_cast<std::uint32_t>(launch.groups), launch.arguments.data());
    check(cudaGetLastError(), fmt::format("launch of kernel '{}'", name));
    if (timing_) {
      check(cudaEventRecord(timed.end, stream_), "cudaEventRecord");
      timed_.push_back(std::move(timed));
    }
  }
  void remember(const char* kernel) {
    if (!since_wait_.empty() && since_wait_.back() == kernel) return;
    since_wait_.emplace_back(kernel);
    // Steps follow each other without a wait; the last ones are enough to know where to look.
    constexpr std::size_t kRemembered = 20;
    if (since_wait_.size() > kRemembered) since_wait_.pop_front();
  }

  Address allocate_raw(std::uint64_t bytes, std::string_view what) override {
    void* taken = nullptr;
    const cudaError_t result = cudaMalloc(&taken, bytes);
    if (result == cudaErrorMemoryAllocation) {
      cudaGetLastError();
      std::size_t free = 0, total = 0;
      cudaMemGetInfo(&free, &total);
      throw OutOfMemory(
          allocated_bytes(), allocated_bytes() - bytes + free,
          "device memory: {} needs {} MB, {} of {} MB are free; use fewer triangles or a lower resolution (-r)", what,
          (bytes >> 20) + 1, free >> 20, total >> 20);
    }
    check(result, "cudaMalloc");
    return reinterpret_cast<Address>(taken);
  }
  void free_raw(Address address) override {
    cudaFree(reinterpret_cast<void*>(address));
  }  // waits for what still reads it
  void* memory(Address address, std::uint64_t bytes) const {
    find(address, bytes);
    return reinterpret_cast<void*>(address);
  }
  void check(cudaError_t result, std::string_view call) {
    if (result == cudaSuccess) return;
    cudaGetLastError();  // or the next launch would be blamed for it
    std::string kernels;
    for (const std::string& kernel : since_wait_) kernels += (kernels.empty() ? "" : ", ") + kernel;
    throw Error(
        "CUDA: {} failed on {} ({}: {}){}", call, info_.name, cudaGetErrorName(result), cudaGetErrorString(result),
        kernels.empty()
            ? std::string()
            : fmt::format("; kernels that may be to blame: {} (CUDA_LAUNCH_BLOCKING=1 names the one)", kernels));
  }

  DeviceInfo info_;
  cudaStream_t stream_ = nullptr;
  std::deque<std::string> since_wait_;  // kernels that no wait has vouched for
  bool timing_ = false;
  std::vector<Timed> timed_;
  std::map<std::string, KernelTiming> timings_;
  std::uint64_t lose_after_ = 0, launches_ = 0;
  std::string lost_;  // the kernel that was running
};

}  // namespace

const std::vector<cuda::CompiledKernel>& cuda::compiled_kernels() {
  static const std::vector<CompiledKernel> all = [] {
    std::vector<CompiledKernel> kernels(exact_kernels().begin(), exact_kernels().end());
    kernels.insert(kernels.end(), contracted_kernels().begin(), contracted_kernels().end());
    return kernels;
  }();
  return all;
}

std::vector<DeviceInfo> list_cuda_devices() {
  std::vector<DeviceInfo> devices;
  for (int i = 0; i < count_devices(); ++i) devices.push_back(describe(i));
  return devices;
}

std::unique_ptr<Device> open_cuda_device(const DeviceOptions& options) {
  const std::vector<DeviceInfo> devices = list_cuda_devices();
  if (devices.empty())
    throw Error("--backend cuda: there is no NVIDIA driver or no NVIDIA GPU here; use vulkan or cpu");
  if (options.device.empty()) return std::make_unique<CudaDevice>(0, options);
  int number = -1;
  const char* end = options.device.data() + options.device.size();
  if (const auto [rest, problem] = std::from_chars(options.device.data(), end, number);
      rest != end || problem != std::errc()) {
    number = -1;
    for (const DeviceInfo& d : devices)
      if (number < 0 && d.name.find(options.device) != std::string::npos) number = d.index;
  }
  if (number < 0 || number >= static_cast<int>(devices.size()))
    throw Error("--device {}: there is no such device; --list-devices names them", options.device);
  return std::make_unique<CudaDevice>(number, options);
}

}  // namespace trisoup::gpu
