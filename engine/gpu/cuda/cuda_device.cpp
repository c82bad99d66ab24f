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
#include "base/printable.h"
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
    throw Error("CUDA: the properties of device {} cannot be read ({}); check the NVIDIA driver", index,
                cudaGetErrorString(cudaGetLastError()));
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

/// Returns 0 if there is no driver.
int count_devices() {
  int count = 0;
  if (cudaGetDeviceCount(&count) != cudaSuccess) {
    cudaGetLastError();  // clears the error, which the next call would report again
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
    // Leaves a tenth to other programs and to the driver.
    ceiling_ = free / 10 * 9;
    check(cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking), "cudaStreamCreateWithFlags");
  }
  ~CudaDevice() override {
    // A destructor cannot report errors. Earlier calls have reported them.
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
    // The source is pageable memory, so its bytes have been copied when the call returns.
    check(cudaMemcpyAsync(target, bytes.data(), bytes.size(), cudaMemcpyHostToDevice, stream_),
          "cudaMemcpyAsync to the device");
  }
  void submit() override {}  // a CUDA stream starts work without a submission
  void wait() override {
    if (!lost_.empty())
      throw Error("{}: the device was lost while running kernel '{}'; continue from the last checkpoint with `resume`",
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
  /// Creates the device's context and loads all kernels. Otherwise the runtime would load each module at the first
  /// launch of one of its kernels. If the program has only PTX for this card, the driver would then compile for seconds
  /// in the middle of a step. Reading the attributes of a kernel loads it without running it.
  void load_kernels(int index) {
    using Clock = std::chrono::steady_clock;
    auto start = Clock::now();
    check(cudaSetDevice(index), "cudaSetDevice");
    // The time to create the context is not counted, unless EAGER loads the modules together with the context.
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

  /// The segments as CUDA graphs: one call per segment instead of one per command.
  struct Graphs final : CommandList::Prepared {
    explicit Graphs(std::uint64_t of) : generation(of) {}
    ~Graphs() override {
      for (cudaGraphExec_t graph : graphs) cudaGraphExecDestroy(graph);  // a running graph is kept until it ends
    }
    std::uint64_t generation;  // Device::generation() at the time of capture
    std::vector<cudaGraphExec_t> graphs;
  };

  void run_list(CommandList& list) override {
    // Graphs are not used for timings, because events in a graph time only its last run, nor for fault injection, which
    // counts launches.
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
    // The relaxed mode is needed because a launch may load its kernel. All calls made here are safe during capture.
    check(cudaStreamBeginCapture(stream_, cudaStreamCaptureModeRelaxed), "cudaStreamBeginCapture");
    cudaGraph_t graph = nullptr;
    try {
      for (const CommandList::Command& command : segment) Device::run(command);
    } catch (...) {
      // The stream must leave capture mode after any error.
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
      throw Error("kernel {}: {} workgroups exceed the limit of a CUDA launch; report this as a bug", name,
                  launch.groups);
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
    // Many steps may run between two waits. The last few kernels are enough to locate an error.
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
      throw OutOfMemory(allocated_bytes(), allocated_bytes() - bytes + free,
                        "device memory: {} needs {} MB, {} of {} MB are free; use fewer triangles or smaller "
                        "photographs (`resolution`)",
                        what, (bytes >> 20) + 1, free >> 20, total >> 20);
    }
    check(result, "cudaMalloc");
    return reinterpret_cast<Address>(taken);
  }
  void free_raw(Address address) override {
    cudaFree(reinterpret_cast<void*>(address));
  }  // waits for kernels that use the memory
  void* memory(Address address, std::uint64_t bytes) const {
    find(address, bytes);
    return reinterpret_cast<void*>(address);
  }
  void check(cudaError_t result, std::string_view call) {
    if (result == cudaSuccess) return;
    cudaGetLastError();  // clears the error, which the next launch would report again
    std::string kernels;
    for (const std::string& kernel : since_wait_) kernels += (kernels.empty() ? "" : ", ") + kernel;
    throw Error("CUDA: {} failed on {} ({}: {}){}", call, info_.name, cudaGetErrorName(result),
                cudaGetErrorString(result),
                kernels.empty()
                    ? std::string()
                    : fmt::format("; possibly in one of the kernels {} (CUDA_LAUNCH_BLOCKING=1 tells which)", kernels));
  }

  DeviceInfo info_;
  cudaStream_t stream_ = nullptr;
  std::deque<std::string> since_wait_;  // kernels launched since the last wait
  bool timing_ = false;
  std::vector<Timed> timed_;
  std::map<std::string, KernelTiming> timings_;
  std::uint64_t lose_after_ = 0, launches_ = 0;
  std::string lost_;  // kernel that was running when the device was lost; empty: not lost
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
  if (devices.empty()) throw Error("`backend` cuda: there is no NVIDIA driver or no NVIDIA GPU; use vulkan or cpu");
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
    throw Error("`device` {}: there is no such device; `list_devices` prints the devices", printable(options.device));
  return std::make_unique<CudaDevice>(number, options);
}

}  // namespace trisoup::gpu
