#include <catch2/catch.hpp>

#include <string>
#include <vector>

#include "gpu/device.h"

using namespace trisoup::gpu;

namespace {

DeviceInfo device(const char* backend, Kind kind) {
  DeviceInfo info;
  info.backend = backend;
  info.kind = kind;
  return info;
}

}  // namespace

TEST_CASE("auto selects a GPU by Vulkan, else by CUDA, else the CPU backend", "[device]") {
  const DeviceInfo lavapipe = device("vulkan", Kind::cpu), card = device("vulkan", Kind::discrete),
                   phone = device("vulkan", Kind::integrated);
  const DeviceInfo cuda = device("cuda", Kind::discrete), cpu = device("cpu", Kind::cpu);
  const DeviceOptions options;
  CHECK(choose_backend(options, {lavapipe, card, cuda, cpu}) == "vulkan");
  CHECK(choose_backend(options, {phone, lavapipe, cpu}) == "vulkan");
  CHECK(choose_backend(options, {device("vulkan", Kind::other), lavapipe, cuda, cpu}) == "vulkan");
  CHECK(choose_backend(options, {lavapipe, cuda, cpu}) == "cuda");
  CHECK(choose_backend(options, {lavapipe, cpu}) == "cpu");
  CHECK(choose_backend(options, {cpu}) == "cpu");
}

TEST_CASE("a given backend, or a feature that only Vulkan has, determines the backend", "[device]") {
  const std::vector<DeviceInfo> none{device("vulkan", Kind::cpu), device("cpu", Kind::cpu)};
  const auto choice = [&](auto set) {
    DeviceOptions options;
    set(options);
    return choose_backend(options, none);
  };
  CHECK(choice([](DeviceOptions& o) { o.draws = true; }) == "vulkan");
  CHECK(choice([](DeviceOptions& o) { o.validation = true; }) == "vulkan");
  CHECK(choice([](DeviceOptions& o) { o.window_extensions = {"VK_KHR_surface"}; }) == "vulkan");
  CHECK(choice([](DeviceOptions& o) { o.backend = "cuda"; }) == "cuda");
  CHECK(choice([](DeviceOptions& o) { o.backend = "cpu", o.validation = true; }) == "cpu");
  CHECK_THROWS_WITH(([] {
                      DeviceOptions options;
                      options.backend = "metal";
                      open_device(options);
                    }()),
                    Catch::Contains("metal"));
}

TEST_CASE("a device is selected by its number in the list, part of its name, or its backend", "[device]") {
  std::vector<DeviceInfo> devices{device("vulkan", Kind::cpu), device("vulkan", Kind::discrete),
                                  device("cuda", Kind::discrete), device("cpu", Kind::cpu)};
  const char* const names[] = {"llvmpipe (LLVM 15.0.6, 256 bits)", "NVIDIA H100", "NVIDIA H100 PCIe", "AMD EPYC 9B45"};
  for (int i = 0; i < 4; ++i)
    devices[static_cast<std::size_t>(i)].index = i, devices[static_cast<std::size_t>(i)].name = names[i];
  const auto chosen = [&](const char* name, auto set) {
    DeviceOptions options;
    options.device = name;
    set(options);
    const DeviceInfo* const info = choose_device(options, devices);
    return info ? info->index : -1;
  };
  const auto plain = [](DeviceOptions&) {};
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
  CHECK(chosen("H100", [](DeviceOptions& o) { o.backend = "cuda"; }) == 2);
  CHECK(chosen("0", [](DeviceOptions& o) { o.backend = "cuda"; }) == -1);
  CHECK(chosen("epyc", [](DeviceOptions& o) { o.draws = true; }) == -1);
  CHECK(chosen("cpu", [](DeviceOptions& o) { o.backend = "vulkan"; }) == -1);
}

TEST_CASE("the time to load kernels is reported if it exceeds a second", "[device]") {
  DeviceInfo slow;
  CHECK(slow_load_note(slow).empty());
  slow.load_seconds = 1;
  CHECK(slow_load_note(slow).empty());
  slow.load_seconds = 12.34;
  CHECK_THAT(slow_load_note(slow), Catch::Matchers::Contains("12.3 s") && Catch::Matchers::Contains("PTX"));
}
