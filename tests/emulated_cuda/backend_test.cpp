// Tests engine/gpu/cuda/cuda_device.cpp: its calls of the CUDA runtime, and its messages if they fail.
#include <catch2/catch.hpp>

#include <functional>

#include <fmt/format.h>

#include "base/error.h"
#include "emulated_cuda/machine.h"
#include "emulated_cuda/runtime.h"
#include "gpu/compiled_kernels.h"
#include "gpu/out_of_memory.h"
#include "gpu/small_scene.h"

using namespace trisoup;
using Catch::Matchers::Contains;

namespace {

std::unique_ptr<gpu::Device> cuda_device() {
  gpu::DeviceOptions options;
  options.backend = "cuda";
  return gpu::open_device(options);
}

/// Resets the runtime at the end of a test.
struct Recovery {
  ~Recovery() { emulated_cuda::recover(); }
};

std::string message_of(const std::function<void()>& call) {
  try {
    call();
  } catch (const Error& e) {
    return e.what();
  }
  return "nothing was wrong";
}

}  // namespace

TEST_CASE("a step becomes a graph once, and again after memory has changed", "[cuda]") {
  auto gpu = cuda_device();
  test::SmallScene s(*gpu, 20, {{0, 0}}, {test::view_from(0, 32, 32)});
  s.buffers.reserve_lists(1 << 16);
  gpu::CommandList list = gpu->record([&] { s.step.train(s.inputs); });
  gpu->wait();
  const auto before = emulated_cuda::operations_of_graphs();
  gpu->replay(list);
  gpu->wait();
  const auto once = emulated_cuda::operations_of_graphs() - before;
  CHECK(once > 10);
  // The second replay does not capture again, so the injected fault has no effect.
  {
    const Recovery recovery;
    emulated_cuda::fail("cudaStreamBeginCapture", cudaErrorInvalidValue);
    gpu->replay(list);
    gpu->wait();
    CHECK(emulated_cuda::operations_of_graphs() - before == 2 * once);
    const gpu::Buffer more = gpu->allocate(64, "more");
    CHECK_THAT(message_of([&] { gpu->replay(list); }), Contains("cudaStreamBeginCapture"));
  }
  gpu->replay(list);
  gpu->wait();
  CHECK(emulated_cuda::operations_of_graphs() - before == 3 * once);
}

TEST_CASE("errors name the call and the kernels that may have caused them", "[cuda]") {
  const Recovery recovery;
  auto gpu = cuda_device();
  test::SmallScene s(*gpu, 20, {{0, 0}}, {test::view_from(0, 32, 32)});
  gpu->wait();
  emulated_cuda::fail("cudaLaunchKernel", cudaErrorLaunchFailure, 3);  // after the writes of the state and project
  CHECK_THAT(message_of([&] {
               s.step.begin(1, 0, 0, {});
               s.step.visibility(train::Thresholds::half, s.inputs);
             }),
             Contains("launch of kernel 'bin'") && Contains("cudaErrorLaunchFailure"));
  emulated_cuda::fail("cudaStreamSynchronize", cudaErrorIllegalAddress);
  CHECK_THAT(message_of([&] { gpu->wait(); }),
             Contains("cudaStreamSynchronize failed") && Contains("project, bin (CUDA"));
  const gpu::Buffer a = gpu->allocate(4096, "a");
  for (const char* call : {"cudaMemcpyAsync", "cudaMemsetAsync"}) {
    emulated_cuda::fail(call, cudaErrorInvalidValue);
    CHECK_THAT(message_of([&] {
                 gpu->fill(a.address(), 4096, 0);
                 gpu->download_vector<std::uint32_t>(a.address(), 4);
               }),
               Contains(call));
  }
}

TEST_CASE("a step that cannot become a graph does not change the device", "[cuda]") {
  const Recovery recovery;
  auto gpu = cuda_device();
  const gpu::Buffer a = gpu->allocate(4096, "a"), b = gpu->allocate(4096, "b");
  gpu->fill(a.address(), 4096, 5);
  gpu->fill(b.address(), 4096, 6);
  gpu::CommandList list = gpu->record([&] {
    gpu->fill(b.address(), 4096, 9);
    gpu->copy(b.address(), a.address(), 2048);
  });
  using Case = std::pair<const char*, const char*>;
  for (const auto& [call, named] : {Case{"cudaGraphInstantiate", "cudaGraphInstantiate"},
                                    {"cudaStreamEndCapture", "cudaStreamEndCapture"},
                                    {"cudaLaunchKernel", "launch of a fill"},
                                    {"cudaMemcpyAsync", "cudaMemcpyAsync on the device"},
                                    {"cudaGraphLaunch", "cudaGraphLaunch"}}) {
    emulated_cuda::fail(call, cudaErrorInvalidValue);
    CHECK_THAT(message_of([&] { gpu->replay(list); }), Contains(std::string(named) + " failed"));
    CHECK(gpu->download_vector<std::uint32_t>(b.address(), 1)[0] == 6);
  }
  gpu->replay(list);
  CHECK(gpu->download_vector<std::uint32_t>(b.address(), 1)[0] == 5);
  CHECK(gpu->download_vector<std::uint32_t>(b.address() + 2048, 1)[0] == 9);
}

TEST_CASE("out-of-memory errors of the driver state the available memory", "[cuda]") {
  const Recovery recovery;
  auto gpu = cuda_device();
  const gpu::Buffer a = gpu->allocate(64 << 20, "a");
  // Another program allocates memory after the ceiling was set.
  const std::uint64_t all = emulated_cuda::machine.total_bytes();
  emulated_cuda::machine.set_total_bytes(100 << 20);
  try {
    gpu->allocate(80 << 20, "the elephant");
    FAIL("there is no room for it");
  } catch (const gpu::OutOfMemory& e) {
    CHECK(e.needed == 144ull << 20);
    CHECK(e.available == 100ull << 20);
    CHECK_THAT(e.what(), Contains("the elephant needs 81 MB, 36 of 100 MB are free"));
  }
  emulated_cuda::machine.set_total_bytes(all);
  CHECK(gpu->allocated_bytes() == 64 << 20);
  CHECK(gpu->allocate(80 << 20, "the elephant").bytes() == 80 << 20);
}

TEST_CASE("a kernel with accesses out of bounds makes later waits fail", "[cuda]") {
  const Recovery recovery;
  auto gpu = cuda_device();
  auto s = std::make_unique<test::SmallScene>(*gpu, 20, std::vector<soup::TextureLevels>{{0, 0}},
                                              std::vector{test::view_from(0, 32, 32)});
  gpu->wait();
  // Frees a buffer that the kernel still uses.
  emulated_cuda::machine.free(s->buffers.hits.address());
  s->step.begin(1, 0, 0, {});
  s->step.visibility(train::Thresholds::half, s->inputs);
  CHECK_THAT(message_of([&] { gpu->wait(); }), Contains("cudaErrorIllegalAddress") && Contains("visibility"));
  CHECK_THAT(message_of([&] { gpu->download_vector<float>(s->buffers.colour.address(), 1); }),
             Contains("cudaErrorIllegalAddress"));
  s.reset();
}

TEST_CASE("kernels are loaded when the device is opened", "[cuda]") {
  const Recovery recovery;
  const auto kernels = static_cast<int>(gpu::cuda::compiled_kernels().size());
  // Checks the last kernel, so all of them are loaded.
  emulated_cuda::fail("cudaFuncGetAttributes", cudaErrorInvalidValue, kernels - 1);
  CHECK_THAT(message_of([] { cuda_device(); }),
             Contains("cudaFuncGetAttributes of kernel '" + std::string(gpu::cuda::compiled_kernels().back().name) +
                      "' failed"));
  emulated_cuda::recover();
  const auto gpu = cuda_device();
  CHECK(gpu->info().load_seconds > 0);
  CHECK(gpu::slow_load_note(gpu->info()).empty());
}

TEST_CASE("resources of a kernel match its PTX", "[cuda]") {
  const Recovery recovery;
  auto gpu = cuda_device();
  for (const gpu::cuda::CompiledKernel& kernel : gpu::cuda::compiled_kernels()) {
    CAPTURE(kernel.name);
    const gpu::Kernel asked{kernel.name.data(), kernel.constants};
    const auto resources = gpu->kernel_resources(asked);
    REQUIRE(resources);
    CHECK(resources->threads == kernel.threads);
    // nvcc removes unused shared memory and aligns the rest.
    CHECK(resources->shared_bytes <= gpu::declared_resources(asked).shared_bytes + 16 * 4);
    CHECK(resources->groups.value() >= 1);
  }
  const auto of = [&](const gpu::Kernel& kernel) { return gpu->kernel_resources(kernel).value(); };
  CHECK(of({"visibility"}).shared_bytes == 64 * 5 * 16);
  CHECK(of({"visibility"}).groups == 12u);
  CHECK(of({"update_textures", {783, 1, 0}}).shared_bytes - of({"update_textures", {3, 1, 0}}).shared_bytes ==
        (783 - 3) * 2 * 16);
  CHECK_FALSE(gpu->kernel_resources({"shade"}).has_value());
  for (const char* call : {"cudaFuncGetAttributes", "cudaOccupancyMaxActiveBlocksPerMultiprocessor"}) {
    emulated_cuda::fail(call, cudaErrorInvalidValue);
    CHECK_THAT(message_of([&] { gpu->kernel_resources({"visibility"}); }), Contains(std::string(call) + " failed"));
  }
}

TEST_CASE("every kernel that the host may launch has PTX", "[cuda]") {
  for (const gpu::cuda::CompiledKernel& kernel : gpu::cuda::compiled_kernels()) {
    CAPTURE(kernel.name);
    // The namespace of the kernel in kernel_variants.cmake.
    std::string space = fmt::format("{}_", kernel.name);
    for (std::size_t i = 0; i < kernel.constants.size(); ++i)
      space +=
          fmt::format("{}{}{}", i > 0 ? "_" : "", kernel.constants[i], kernel.first_is_length && i == 0 ? "_" : "");
    const std::string mangled = fmt::format("{}{}6kernelE", space.size(), space);
    const auto kernels = emulated_cuda::all_kernels();
    const auto found =
        std::ranges::find_if(kernels, [&](const auto* k) { return k->name.find(mangled) != std::string_view::npos; });
    REQUIRE(found != kernels.end());
    CHECK((*found)->most_threads == kernel.threads);
    CHECK((*found)->parameter_bytes == kernel.argument_bytes);
    CHECK((!(*found)->barriers || kernel.barriers));
  }
}
