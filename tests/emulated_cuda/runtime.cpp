// Emulates the part of the CUDA runtime that the CUDA backend calls, on the machine in machine.h. It makes mistakes of
// the caller visible: a stream runs only when the program waits for it, so missing waits read old data, and any call
// that the strictest capture mode forbids invalidates a capture.
#include "emulated_cuda/runtime.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "emulated_cuda/machine.h"

using trisoup::emulated_cuda::Fault;
using trisoup::emulated_cuda::find_kernel;
using trisoup::emulated_cuda::Kernel;
using trisoup::emulated_cuda::machine;

using Operation = std::function<void()>;

struct CUevent_st {
  std::chrono::steady_clock::time_point time{};
  bool recorded = false, reached = false;
};
struct CUgraph_st {
  std::vector<Operation> operations;
};
struct CUgraphExec_st {
  std::shared_ptr<const std::vector<Operation>> operations;
};
struct CUstream_st {
  std::vector<Operation> waiting;
  std::unique_ptr<CUgraph_st> capture;  // receives the operations instead of the stream
  bool invalidated = false;
};
struct CUkern_st {
  std::string name;
};

namespace {

struct Injected {
  cudaError_t error;
  int after;
};

struct Runtime {
  std::map<const void*, CUkern_st> kernels;  // by the address of the host's function
  std::vector<CUstream_st*> streams;
  std::map<std::string, Injected, std::less<>> injected;
  cudaError_t last = cudaSuccess, sticky = cudaSuccess;
  unsigned long long operations_of_graphs = 0;
  dim3 grid, block;
  std::size_t shared = 0;
  cudaStream_t stream = nullptr;
};
Runtime& runtime() {  // kernels register before main
  static Runtime all;
  return all;
}

cudaError_t result(cudaError_t error) {
  if (error != cudaSuccess) runtime().last = error;
  return error;
}

/// Returns the error with which a call must fail at once: an injected fault, or the error of a lost device.
cudaError_t refused(std::string_view call) {
  Runtime& r = runtime();
  if (const auto asked = r.injected.find(call); asked != r.injected.end() && asked->second.after-- == 0) {
    const cudaError_t error = asked->second.error;
    r.injected.erase(asked);
    return result(error);
  }
  return r.sticky == cudaSuccess ? cudaSuccess : result(r.sticky);
}
#define RETURN_IF_REFUSED(call) \
  if (const cudaError_t error = refused(call); error != cudaSuccess) return error

cudaError_t refuse(const char* what, cudaError_t error) {
  std::fprintf(stderr, "emulated CUDA: %s\n", what);
  return result(error);
}

/// Invalidates captures at calls that are not allowed during a capture.
cudaError_t forbidden_in_capture(const char* call) {
  for (CUstream_st* stream : runtime().streams)
    if (stream->capture) {
      stream->invalidated = true;
      std::fprintf(stderr, "emulated CUDA: %s while a stream is captured\n", call);
      return result(cudaErrorStreamCaptureUnsupported);
    }
  return cudaSuccess;
}
#define RETURN_IF_CAPTURING(call) \
  if (const cudaError_t error = forbidden_in_capture(call); error != cudaSuccess) return error

cudaError_t run_all(CUstream_st* stream) {
  Runtime& r = runtime();
  const std::vector<Operation> operations = std::exchange(stream->waiting, {});
  for (const Operation& operation : operations) {
    if (r.sticky != cudaSuccess) break;
    operation();
    if (machine.fault() != Fault::none)
      r.sticky = machine.fault() == Fault::memory ? cudaErrorIllegalAddress : cudaErrorLaunchFailure;
  }
  return r.sticky == cudaSuccess ? cudaSuccess : result(r.sticky);
}

void give(CUstream_st* stream, Operation operation) {
  (stream->capture ? stream->capture->operations : stream->waiting).push_back(std::move(operation));
}

cudaError_t outside(std::uint64_t address, std::uint64_t bytes, const char* call) {
  if (machine.holds(address, bytes)) return cudaSuccess;
  return refuse(call, cudaErrorInvalidValue);
}

}  // namespace

namespace trisoup::emulated_cuda {

void fail(std::string_view call, cudaError_t error, int after) {
  runtime().injected[std::string(call)] = {error, after};
}
void recover() {
  machine.forget_findings();
  runtime().injected.clear();
  runtime().last = runtime().sticky = cudaSuccess;
}
unsigned long long operations_of_graphs() { return runtime().operations_of_graphs; }

}  // namespace trisoup::emulated_cuda

extern "C" {

// Functions for the host code that nvcc generates.
void** __cudaRegisterFatBinary(void*) {
  static void* module = nullptr;
  return &module;
}
void __cudaRegisterFatBinaryEnd(void**) {}
void __cudaUnregisterFatBinary(void**) {}
void __cudaRegisterFunction(void**, const char* host, char*, const char* name, int, uint3*, uint3*, dim3*, dim3*,
                            int*) {
  runtime().kernels[host].name = name;
}
char __cudaInitModule(void**) { return 1; }
cudaError_t __cudaGetKernel(cudaKernel_t* kernel, const void* host) {
  const auto found = runtime().kernels.find(host);
  if (found == runtime().kernels.end()) return result(cudaErrorInvalidDeviceFunction);
  *kernel = &found->second;
  return cudaSuccess;
}
unsigned __cudaPushCallConfiguration(dim3 grid, dim3 block, std::size_t shared, CUstream_st* stream) {
  Runtime& r = runtime();
  r.grid = grid, r.block = block, r.shared = shared, r.stream = stream;
  return 0;
}
cudaError_t __cudaPopCallConfiguration(dim3* grid, dim3* block, std::size_t* shared, void* stream) {
  const Runtime& r = runtime();
  *grid = r.grid, *block = r.block, *shared = r.shared;
  *static_cast<cudaStream_t*>(stream) = r.stream;
  return cudaSuccess;
}
cudaError_t __cudaLaunchKernel(cudaKernel_t handle, dim3 grid, dim3 block, void** arguments, std::size_t shared,
                               cudaStream_t stream) {
  RETURN_IF_REFUSED("cudaLaunchKernel");
  const Kernel* const kernel = handle ? find_kernel(handle->name) : nullptr;
  if (!kernel)
    return refuse(("there is no PTX of kernel " + (handle ? handle->name : "null")).c_str(),
                  cudaErrorInvalidDeviceFunction);
  if (grid.x == 0 || grid.x > 0x7fffffffu || grid.y != 1 || grid.z != 1 || block.x == 0 ||
      block.x > kernel->most_threads || block.y != 1 || block.z != 1 || shared != 0 || !stream)
    return refuse("a launch of a shape that there is not", cudaErrorInvalidConfiguration);
  std::vector<std::byte> bytes((kernel->parameter_bytes + 15) / 16 * 16);
  for (std::size_t i = 0; i < kernel->parameters.size(); ++i)
    std::memcpy(bytes.data() + kernel->parameters[i].first, arguments[i], kernel->parameters[i].second);
  give(stream, [kernel, groups = grid.x, threads = block.x, bytes = std::move(bytes)] {
    machine.run(*kernel, groups, threads, bytes.data());
  });
  return cudaSuccess;
}

// Resources of kernels. The number of registers is 0, because PTX has unlimited virtual registers.
cudaError_t cudaFuncGetAttributes(cudaFuncAttributes* attributes, const void* host) {
  RETURN_IF_REFUSED("cudaFuncGetAttributes");
  // Loading the first kernel of a program loads its module, which a driver may have to compile.
  static const bool loaded = [] {
    if (const char* seconds = std::getenv("TRISOUP_COMPILE_SECONDS"))
      std::this_thread::sleep_for(std::chrono::duration<double>(std::atof(seconds)));
    return true;
  }();
  (void)loaded;
  cudaKernel_t handle = nullptr;
  if (const cudaError_t error = __cudaGetKernel(&handle, host); error != cudaSuccess) return error;
  const Kernel* const kernel = find_kernel(handle->name);
  if (!kernel) return refuse(("there is no PTX of kernel " + handle->name).c_str(), cudaErrorInvalidDeviceFunction);
  *attributes = {};
  attributes->sharedSizeBytes = kernel->shared_bytes;
  attributes->localSizeBytes = kernel->local_bytes;
  attributes->maxThreadsPerBlock = static_cast<int>(kernel->most_threads);
  return cudaSuccess;
}
/// Occupancy from shared memory and threads, for a multiprocessor with 64 KB, 1024 threads and 16 workgroups, as in
/// Turing.
cudaError_t cudaOccupancyMaxActiveBlocksPerMultiprocessor(int* groups, const void* host, int threads,
                                                          std::size_t dynamic) {
  RETURN_IF_REFUSED("cudaOccupancyMaxActiveBlocksPerMultiprocessor");
  cudaFuncAttributes attributes;
  if (const cudaError_t error = cudaFuncGetAttributes(&attributes, host); error != cudaSuccess) return error;
  if (threads <= 0 || threads > attributes.maxThreadsPerBlock)
    return refuse("groups of a size that there is not", cudaErrorInvalidValue);
  const std::size_t shared = attributes.sharedSizeBytes + dynamic;
  *groups = static_cast<int>(
      std::min({std::size_t{16}, 1024 / static_cast<std::size_t>(threads), shared == 0 ? 16 : (64 << 10) / shared}));
  return cudaSuccess;
}

// Devices.
cudaError_t cudaGetDeviceCount(int* count) {
  RETURN_IF_REFUSED("cudaGetDeviceCount");
  *count = 1;
  return cudaSuccess;
}
cudaError_t cudaGetDeviceProperties(cudaDeviceProp* properties, int device) {
  RETURN_IF_REFUSED("cudaGetDeviceProperties");
  if (device != 0) return result(cudaErrorInvalidDevice);
  *properties = {};
  std::strcpy(properties->name, "emulated CUDA device");
  properties->totalGlobalMem = machine.total_bytes();
  properties->warpSize = 32;
  return cudaSuccess;
}
cudaError_t cudaDriverGetVersion(int* version) {
  *version = CUDART_VERSION;
  return cudaSuccess;
}
cudaError_t cudaRuntimeGetVersion(int* version) {
  *version = CUDART_VERSION;
  return cudaSuccess;
}
cudaError_t cudaSetDevice(int device) {
  RETURN_IF_REFUSED("cudaSetDevice");
  return device == 0 ? cudaSuccess : result(cudaErrorInvalidDevice);
}
cudaError_t cudaGetLastError() { return std::exchange(runtime().last, runtime().sticky); }
const char* cudaGetErrorName(cudaError_t error) {
  switch (error) {
    case cudaSuccess:
      return "cudaSuccess";
    case cudaErrorInvalidValue:
      return "cudaErrorInvalidValue";
    case cudaErrorMemoryAllocation:
      return "cudaErrorMemoryAllocation";
    case cudaErrorIllegalAddress:
      return "cudaErrorIllegalAddress";
    case cudaErrorLaunchFailure:
      return "cudaErrorLaunchFailure";
    default:
      return "cudaError of another kind";
  }
}
const char* cudaGetErrorString(cudaError_t error) { return cudaGetErrorName(error); }

// Memory.
cudaError_t cudaMemGetInfo(std::size_t* free, std::size_t* total) {
  RETURN_IF_REFUSED("cudaMemGetInfo");
  *free = machine.free_bytes();
  *total = machine.total_bytes();
  return cudaSuccess;
}
cudaError_t cudaMalloc(void** memory, std::size_t bytes) {
  RETURN_IF_REFUSED("cudaMalloc");
  RETURN_IF_CAPTURING("cudaMalloc");
  const std::uint64_t taken = machine.allocate(bytes);
  if (taken == 0) return result(cudaErrorMemoryAllocation);
  *memory = reinterpret_cast<void*>(taken);
  return cudaSuccess;
}
cudaError_t cudaFree(void* memory) {
  for (CUstream_st* stream : runtime().streams) run_all(stream);
  RETURN_IF_CAPTURING("cudaFree");
  if (memory && !machine.free(reinterpret_cast<std::uint64_t>(memory)))
    return refuse("cudaFree of what is no allocation", cudaErrorInvalidValue);
  return refused("cudaFree");
}
cudaError_t cudaMemcpyAsync(void* to, const void* from, std::size_t bytes, cudaMemcpyKind kind, cudaStream_t stream) {
  RETURN_IF_REFUSED("cudaMemcpyAsync");
  const auto target = reinterpret_cast<std::uint64_t>(to), source = reinterpret_cast<std::uint64_t>(from);
  if (kind == cudaMemcpyHostToDevice) {
    if (const cudaError_t error = outside(target, bytes, "cudaMemcpyAsync to where no allocation is")) return error;
    if (stream->capture)
      return refuse("a copy from the host's memory is captured, which may be gone when it runs",
                    cudaErrorStreamCaptureUnsupported);
    std::vector<std::byte> taken(bytes);
    std::memcpy(taken.data(), from, bytes);
    give(stream, [to, taken = std::move(taken)] { std::memcpy(to, taken.data(), taken.size()); });
  } else if (kind == cudaMemcpyDeviceToHost) {
    if (const cudaError_t error = outside(source, bytes, "cudaMemcpyAsync from where no allocation is")) return error;
    if (stream->capture) return refuse("a copy to the host's memory is captured", cudaErrorStreamCaptureUnsupported);
    give(stream, [=] { std::memcpy(to, from, bytes); });
  } else {
    if (const cudaError_t error = outside(source, bytes, "cudaMemcpyAsync from where no allocation is")) return error;
    if (const cudaError_t error = outside(target, bytes, "cudaMemcpyAsync to where no allocation is")) return error;
    if (source < target + bytes && target < source + bytes)
      return refuse("cudaMemcpyAsync between overlapping memory", cudaErrorInvalidValue);
    give(stream, [=] { std::memcpy(to, from, bytes); });
  }
  return cudaSuccess;
}
cudaError_t cudaMemsetAsync(void* to, int value, std::size_t bytes, cudaStream_t stream) {
  RETURN_IF_REFUSED("cudaMemsetAsync");
  if (const cudaError_t error =
          outside(reinterpret_cast<std::uint64_t>(to), bytes, "cudaMemsetAsync where no allocation is"))
    return error;
  give(stream, [=] { std::memset(to, value, bytes); });
  return cudaSuccess;
}

// Streams and events.
cudaError_t cudaStreamCreateWithFlags(cudaStream_t* stream, unsigned) {
  RETURN_IF_REFUSED("cudaStreamCreateWithFlags");
  *stream = new CUstream_st;
  runtime().streams.push_back(*stream);
  return cudaSuccess;
}
cudaError_t cudaStreamDestroy(cudaStream_t stream) {
  run_all(stream);
  std::erase(runtime().streams, stream);
  delete stream;
  return cudaSuccess;
}
cudaError_t cudaStreamSynchronize(cudaStream_t stream) {
  if (const cudaError_t error = refused("cudaStreamSynchronize"); error != cudaSuccess) {
    stream->waiting.clear();  // the operations may write to memory of the caller that no longer exists
    return error;
  }
  RETURN_IF_CAPTURING("cudaStreamSynchronize");
  return run_all(stream);
}
cudaError_t cudaEventCreate(cudaEvent_t* event) {
  RETURN_IF_REFUSED("cudaEventCreate");
  *event = new CUevent_st;
  return cudaSuccess;
}
cudaError_t cudaEventDestroy(cudaEvent_t event) {
  delete event;
  return cudaSuccess;
}
cudaError_t cudaEventRecord(cudaEvent_t event, cudaStream_t stream) {
  RETURN_IF_REFUSED("cudaEventRecord");
  event->recorded = true;
  give(stream, [event] {
    event->time = std::chrono::steady_clock::now();
    event->reached = true;
  });
  return cudaSuccess;
}
cudaError_t cudaEventElapsedTime(float* milliseconds, cudaEvent_t start, cudaEvent_t end) {
  RETURN_IF_REFUSED("cudaEventElapsedTime");
  if (!start->recorded || !end->recorded) return result(cudaErrorInvalidResourceHandle);
  if (!start->reached || !end->reached) return result(cudaErrorNotReady);
  *milliseconds = std::chrono::duration<float, std::milli>(end->time - start->time).count();
  return cudaSuccess;
}

// Graphs.
cudaError_t cudaStreamBeginCapture(cudaStream_t stream, cudaStreamCaptureMode) {
  RETURN_IF_REFUSED("cudaStreamBeginCapture");
  if (stream->capture) return result(cudaErrorIllegalState);
  stream->capture = std::make_unique<CUgraph_st>();
  stream->invalidated = false;
  return cudaSuccess;
}
cudaError_t cudaStreamEndCapture(cudaStream_t stream, cudaGraph_t* graph) {
  *graph = nullptr;
  std::unique_ptr<CUgraph_st> captured = std::exchange(stream->capture, nullptr);
  if (!captured) return result(cudaErrorIllegalState);
  if (stream->invalidated) return result(cudaErrorStreamCaptureInvalidated);
  RETURN_IF_REFUSED("cudaStreamEndCapture");
  *graph = captured.release();
  return cudaSuccess;
}
cudaError_t cudaGraphInstantiate(cudaGraphExec_t* ready, cudaGraph_t graph, unsigned long long) {
  RETURN_IF_REFUSED("cudaGraphInstantiate");
  *ready = new CUgraphExec_st{std::make_shared<const std::vector<Operation>>(graph->operations)};
  return cudaSuccess;
}
cudaError_t cudaGraphDestroy(cudaGraph_t graph) {
  delete graph;
  return cudaSuccess;
}
cudaError_t cudaGraphExecDestroy(cudaGraphExec_t graph) {
  delete graph;
  return cudaSuccess;
}
cudaError_t cudaGraphLaunch(cudaGraphExec_t graph, cudaStream_t stream) {
  RETURN_IF_REFUSED("cudaGraphLaunch");
  if (stream->capture) return result(cudaErrorStreamCaptureUnsupported);
  give(stream, [operations = graph->operations] {
    for (const Operation& operation : *operations) {
      if (machine.fault() != Fault::none) return;
      operation();
      ++runtime().operations_of_graphs;
    }
  });
  return cudaSuccess;
}

}  // extern "C"
