// Tests engine/gpu/device.h on the device under test.
#include <catch2/catch.hpp>

#include <numeric>

#include "base/error.h"
#include "gpu/out_of_memory.h"
#include "gpu/small_scene.h"

using namespace trisoup;
using Catch::Matchers::Contains;

TEST_CASE("uploads, copies and downloads of any size give the same data, in order", "[device][each_driver]") {
  auto gpu = test::open_own_device();
  // Below and above the inline limit of 64 KiB and the staging buffer of 64 MiB.
  for (const std::size_t count : {1ul, 1000ul, 16384ul, 16385ul, 17ul << 20}) {
    std::vector<std::uint32_t> values(count);
    std::iota(values.begin(), values.end(), 5u);
    const gpu::Buffer a = gpu->allocate(count * 4, "a"), b = gpu->allocate(count * 4, "b");
    gpu->upload(a.address(), values);
    gpu->copy(b.address(), a.address(), count * 4);
    gpu->fill(a.address(), count * 4, 7);
    CHECK(gpu->download_vector<std::uint32_t>(b.address(), count) == values);
    CHECK(gpu->download_vector<std::uint32_t>(a.address(), count) == std::vector<std::uint32_t>(count, 7));
  }
  test::require_silence(*gpu);
}

TEST_CASE("allocated memory is counted and limited by the ceiling", "[device]") {
  auto gpu = test::open_own_device();
  const std::uint64_t before = gpu->allocated_bytes();
  {
    const gpu::Buffer a = gpu->allocate(1 << 20, "a");
    CHECK(gpu->allocated_bytes() == before + (1 << 20));
    gpu->set_ceiling(before + (2 << 20));
    CHECK_THROWS_WITH(gpu->allocate(4 << 20, "the elephant"), Contains("the elephant") && Contains("MB"));
    try {
      gpu->allocate(4 << 20, "the elephant");
    } catch (const gpu::OutOfMemory& e) {
      CHECK(e.needed == before + (5 << 20));
      CHECK(e.available == before + (2 << 20));
    }
  }
  CHECK(gpu->allocated_bytes() == before);
  test::require_silence(*gpu);
}

TEST_CASE("a copy outside all buffers throws an error", "[device]") {
  auto gpu = test::open_own_device();
  const gpu::Buffer a = gpu->allocate(64, "a");
  std::vector<std::uint32_t> out(17);
  CHECK_THROWS_AS(gpu->download(a.address(), std::as_writable_bytes(std::span(out))), Error);
}

TEST_CASE("errors name a kernel or a device that does not exist", "[device]") {
  auto gpu = test::open_own_device();
  CHECK_THROWS_WITH(gpu->launch({"no_such_kernel"}, 1, std::uint64_t(0)), Contains("no_such_kernel"));
  gpu::DeviceOptions options;
  options.device = "no such device";
  CHECK_THROWS_WITH(gpu::open_device(options), Contains("no such device"));
  options.device = "99";
  CHECK_THROWS_WITH(gpu::open_device(options), Contains("99"));
}

TEST_CASE("recorded commands run at each replay, after earlier commands", "[device][each_driver]") {
  auto gpu = test::open_own_device();
  const gpu::Buffer a = gpu->allocate(16, "a"), b = gpu->allocate(16, "b"), c = gpu->allocate(16, "c");
  gpu->fill(a.address(), 16, 1);
  gpu->fill(b.address(), 16, 2);
  gpu->fill(c.address(), 16, 3);
  gpu::CommandList list = gpu->record([&] {
    gpu->copy(c.address(), b.address(), 16);
    gpu->cut();
    gpu->cut();  // an empty segment is dropped
    gpu->copy(b.address(), a.address(), 16);
  });
  CHECK(list.segments.size() == 2);
  CHECK(gpu->download_vector<std::uint32_t>(c.address(), 1)[0] == 3);
  for (std::uint32_t i = 10; i < 20; ++i) {
    gpu->fill(a.address(), 16, i);
    gpu->replay(list);
    gpu->replay(list);
    CHECK(gpu->download_vector<std::uint32_t>(c.address(), 1)[0] == i);
    CHECK(gpu->download_vector<std::uint32_t>(b.address(), 1)[0] == i);
  }
  CHECK_THROWS_AS(gpu->record([&] { throw Error("in the middle"); }), Error);
  gpu->fill(c.address(), 16, 7);
  CHECK(gpu->download_vector<std::uint32_t>(c.address(), 1)[0] == 7);
  test::require_silence(*gpu);
}

TEST_CASE("the error of a lost device names the kernel that was running", "[device]") {
  // The first launch of a small scene is sum_textures. Then come project, bin, bin_scan, bin and visibility.
  auto gpu = test::open_own_device(4);
  test::SmallScene s(*gpu, 5, {{0, 0}}, {test::view_from(0, 16, 16)});
  s.step.begin(1, 0, 0, {});
  s.step.visibility(train::Thresholds::half, s.inputs);
  CHECK_THROWS_WITH(gpu->wait(), Contains("lost") && Contains("'bin_scan'"));
}

TEST_CASE("kernels are timed if timings are enabled", "[device]") {
  auto gpu = test::open_own_device();
  test::SmallScene s(*gpu, 5, {{0, 0}}, {test::view_from(0, 64, 64)});
  gpu->enable_timings(true);  // while commands are being recorded
  s.step.begin(1, 0, 0, {});
  s.step.visibility(train::Thresholds::half, s.inputs);
  const auto timings = gpu->timings();
  REQUIRE(timings.contains("visibility"));
  CHECK(timings.at("bin").launches == 2);
  CHECK(timings.at("visibility").milliseconds > 0);
  test::require_silence(*gpu);
}

TEST_CASE("every device has a unique number and can be opened by it", "[device]") {
  const std::vector<gpu::DeviceInfo> devices = gpu::list_devices();
  REQUIRE_FALSE(devices.empty());
  for (std::size_t i = 0; i < devices.size(); ++i) CHECK(devices[i].index == static_cast<int>(i));
  gpu::DeviceOptions options;
  options.device = std::to_string(devices.back().index);
  CHECK(gpu::open_device(options)->info().backend == devices.back().backend);
  options.device = "cpu";
  CHECK(gpu::open_device(options)->info().backend == "cpu");
}
