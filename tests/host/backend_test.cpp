#include <catch2/catch.hpp>

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

TEST_CASE("auto is a GPU through Vulkan, else through CUDA, else the CPU's own threads", "[device]") {
  const DeviceInfo lavapipe = device("vulkan", Kind::cpu), card = device("vulkan", Kind::discrete), phone = device("vulkan", Kind::integrated);
  const DeviceInfo cuda = device("cuda", Kind::discrete), cpu = device("cpu", Kind::cpu);
  const DeviceOptions options;
  CHECK(choose_backend(options, {lavapipe, card, cuda, cpu}) == "vulkan");
  CHECK(choose_backend(options, {phone, lavapipe, cpu}) == "vulkan");
  CHECK(choose_backend(options, {device("vulkan", Kind::other), lavapipe, cuda, cpu}) == "vulkan");
  CHECK(choose_backend(options, {lavapipe, cuda, cpu}) == "cuda");
  CHECK(choose_backend(options, {lavapipe, cpu}) == "cpu");
  CHECK(choose_backend(options, {cpu}) == "cpu");
}

TEST_CASE("a backend that was asked for, and what only Vulkan has, decide by themselves", "[device]") {
  const std::vector<DeviceInfo> none{device("vulkan", Kind::cpu), device("cpu", Kind::cpu)};
  const auto choice = [&](auto set) {
    DeviceOptions options;
    set(options);
    return choose_backend(options, none);
  };
  CHECK(choice([](DeviceOptions& o) { o.draws = true; }) == "vulkan");
  CHECK(choice([](DeviceOptions& o) { o.validation = true; }) == "vulkan");
  CHECK(choice([](DeviceOptions& o) { o.device = "llvm"; }) == "vulkan");
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
