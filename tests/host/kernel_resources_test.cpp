// Tests engine/gpu/kernel_resources.h.
#include <catch2/catch.hpp>

#include "gpu/compiled_kernels.h"
#include "gpu/kernel_resources.h"
#include "gpu/vulkan/vulkan_instance.h"

using namespace trisoup;
using Catch::Matchers::Contains;

TEST_CASE("threads and shared memory are read from the kernel source", "[kernel_resources]") {
  CHECK(gpu::declared_resources({"quantise"}).threads == 64);
  CHECK(gpu::declared_resources({"quantise"}).shared_bytes == 0);
  CHECK(gpu::declared_resources({"bin_scan"}).threads == 256);
  CHECK(gpu::declared_resources({"bin_scan"}).shared_bytes == 256 * 8);
  CHECK(gpu::declared_resources({"visibility"}).shared_bytes == 64 * 5 * 16);  // four vec4 and a uvec4 per thread
  CHECK(gpu::declared_resources({"ssim"}).shared_bytes == (2 * 26 * 26 + 4 * 26 * 16 + 64 + 1) * 4);
  CHECK_FALSE(gpu::declared_resources({"quantise"}).registers.has_value());
  CHECK_THROWS_WITH(gpu::declared_resources({"no_such_kernel"}), Contains("no_such_kernel"));
}

TEST_CASE("the length of a shared array can be a specialisation constant", "[kernel_resources]") {
  const auto bytes = [](std::vector<std::uint32_t> constants) {
    return gpu::declared_resources({"update_textures", std::move(constants)}).shared_bytes;
  };
  CHECK(bytes({783, 1, 0}) - bytes({3, 1, 0}) == (783 - 3) * 2 * 16);  // two uvec4 per element
  CHECK(bytes({}) == bytes({774}));                                    // default value in the shader
}

TEST_CASE("kernels stay below the required shared memory and have the same threads as in C++", "[kernel_resources]") {
  for (const gpu::host::CompiledKernel& k : gpu::host::compiled_kernels()) {
    CAPTURE(k.name);
    const gpu::KernelResources r = gpu::declared_resources({k.name.data(), k.constants});
    CHECK(r.threads == k.threads);
    CHECK(r.shared_bytes <= gpu::kSharedMemoryBytes);
  }
}

TEST_CASE("statistics of drivers are recognised", "[kernel_resources]") {
  gpu::KernelResources r;
  r.shared_bytes = 100;
  gpu::take_statistic(r, "Binary Size", 5000);
  CHECK_FALSE(r.registers.has_value());
  CHECK_FALSE(r.local_bytes.has_value());
  CHECK(r.shared_bytes == 100);
  gpu::take_statistic(r, "Register Count", 40);
  gpu::take_statistic(r, "Register Count", 32);  // a narrower version of the kernel
  gpu::take_statistic(r, "Scratch size", 0);
  gpu::take_statistic(r, "LDS size", 128);
  CHECK(r.registers == 40u);
  CHECK(r.local_bytes == 0u);
  CHECK(r.shared_bytes == 128);
}
