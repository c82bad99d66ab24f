#include <catch2/catch.hpp>

#include <string>
#include <vector>

#include "gpu/device.h"

using namespace trisoup;

namespace {

gpu::DeviceInfo device(const char* backend, gpu::Kind kind) {
  gpu::DeviceInfo info;
  info.backend = backend;
  info.kind = kind;
  return info;
}

}  // namespace

TEST_CASE("auto selects a GPU by Vulkan, else by CUDA, else the CPU backend", "[device]") {
  const gpu::DeviceInfo lavapipe = device("vulkan", gpu::Kind::cpu), card = device("vulkan", gpu::Kind::discrete),
                        phone = device("vulkan", gpu::Kind::integrated);
  const gpu::DeviceInfo cuda = device("cuda", gpu::Kind::discrete), cpu = device("cpu", gpu::Kind::cpu);
  const gpu::DeviceOptions options;
  CHECK(gpu::choose_backend(options, {lavapipe, card, cuda, cpu}) == "vulkan");
  CHECK(gpu::choose_backend(options, {phone, lavapipe, cpu}) == "vulkan");
  CHECK(gpu::choose_backend(options, {device("vulkan", gpu::Kind::other), lavapipe, cuda, cpu}) == "vulkan");
  CHECK(gpu::choose_backend(options, {lavapipe, cuda, cpu}) == "cuda");
  CHECK(gpu::choose_backend(options, {lavapipe, cpu}) == "cpu");
  CHECK(gpu::choose_backend(options, {cpu}) == "cpu");
}

TEST_CASE("a given backend, or a feature that only Vulkan has, determines the backend", "[device]") {
  const std::vector<gpu::DeviceInfo> none{device("vulkan", gpu::Kind::cpu), device("cpu", gpu::Kind::cpu)};
  const auto choice = [&](auto set) {
    gpu::DeviceOptions options;
    set(options);
    return gpu::choose_backend(options, none);
  };
  CHECK(choice([](gpu::DeviceOptions& o) { o.draws = true; }) == "vulkan");
  CHECK(choice([](gpu::DeviceOptions& o) { o.validation = true; }) == "vulkan");
  CHECK(choice([](gpu::DeviceOptions& o) { o.window_extensions = {"VK_KHR_surface"}; }) == "vulkan");
  CHECK(choice([](gpu::DeviceOptions& o) { o.backend = "cuda"; }) == "cuda");
  CHECK(choice([](gpu::DeviceOptions& o) { o.backend = "cpu", o.validation = true; }) == "cpu");
  CHECK_THROWS_WITH(([] {
                      gpu::DeviceOptions options;
                      options.backend = "metal";
                      gpu::open_device(options);
                    }()),
                    Catch::Contains("metal"));
}

TEST_CASE("a device is selected by its number in the list, part of its name, or its backend", "[device]") {
  std::vector<gpu::DeviceInfo> devices{device("vulkan", gpu::Kind::cpu), device("vulkan", gpu::Kind::discrete),
                                       device("cuda", gpu::Kind::discrete), device("cpu", gpu::Kind::cpu)};
  const char* const names[] = {"llvmpipe (LLVM 15.0.6, 256 bits)", "NVIDIA H100", "NVIDIA H100 PCIe", "AMD EPYC 9B45"};
  for (int i = 0; i < 4; ++i)
    devices[static_cast<std::size_t>(i)].index = i, devices[static_cast<std::size_t>(i)].name = names[i];
  const auto chosen = [&](const char* name, auto set) {
    gpu::DeviceOptions options;
    options.device = name;
    set(options);
    const gpu::DeviceInfo* const info = gpu::choose_device(options, devices);
    return info ? info->index : -1;
  };
  const auto plain = [](gpu::DeviceOptions&) {};
  for (int i = 0; i < 4; ++i) CHECK(chosen(std::to_string(i).c_str(), plain) == i);
  CHECK(chosen("4", plain) == -1);
  CHECK(chosen("llvm", plain) == 0);
  CHECK(chosen("LLVMPIPE", plain) == 0);
  CHECK(chosen("h100", plain) == 1);
  CHECK(chosen("PCIe", plain) == 2);
  CHECK(chosen("epyc", plain) == 3);
  CHECK(chosen("cpu", plain) == 3);
  CHECK(chosen("CUDA", plain) == 2);
  CHECK(chosen("vulkan", plain) == 1);  // the fastest kind of device
  CHECK(chosen("no such", plain) == -1);
  // Only devices of the given backend with the required features are considered.
  CHECK(chosen("H100", [](gpu::DeviceOptions& o) { o.backend = "cuda"; }) == 2);
  CHECK(chosen("0", [](gpu::DeviceOptions& o) { o.backend = "cuda"; }) == -1);
  CHECK(chosen("epyc", [](gpu::DeviceOptions& o) { o.draws = true; }) == -1);
  CHECK(chosen("cpu", [](gpu::DeviceOptions& o) { o.backend = "vulkan"; }) == -1);
}

TEST_CASE("the time to load kernels is reported if it exceeds a second", "[device]") {
  gpu::DeviceInfo slow;
  CHECK(slow_load_note(slow).empty());
  slow.load_seconds = 1;
  CHECK(slow_load_note(slow).empty());
  slow.load_seconds = 12.34;
  CHECK_THAT(slow_load_note(slow), Catch::Matchers::Contains("12.3 s") && Catch::Matchers::Contains("PTX"));
}
