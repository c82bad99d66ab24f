// Tests engine/gpu/vulkan/vulkan_instance.h.
#include <catch2/catch.hpp>

#include <atomic>
#include <barrier>
#include <memory>
#include <thread>
#include <vector>

#include "gpu/small_scene.h"
#include "gpu/vulkan/vulkan_backend.h"
#include "gpu/vulkan/vulkan_instance.h"

using namespace trisoup;

namespace {

/// Opens the device without validation, so that instances are shared. Returns null if another backend is under test.
std::unique_ptr<gpu::Device> open_without_validation() {
  gpu::DeviceOptions options = test::device_options();
  options.validation = false;
  if (options.backend != "vulkan") return nullptr;
  return gpu::open_device(options);
}

bool fills(gpu::Device& gpu, std::uint32_t value) {
  const gpu::Buffer a = gpu.allocate(64, "a");
  gpu.fill(a.address(), 64, value);
  return gpu.download_vector<std::uint32_t>(a.address(), 16) == std::vector<std::uint32_t>(16, value);
}

/// Calls vkCmdFillBuffer with a size that is not a multiple of 4, which the validation layer reports.
void make_a_mistake(gpu::Device& gpu) {
  const gpu::Buffer a = gpu.allocate(64, "a");
  gpu.fill(a.address(), 6, 1);
  gpu.wait();
}

}  // namespace

TEST_CASE("200 consecutive devices use one instance", "[instance]") {
  if (!open_without_validation()) return;
  const std::size_t before = gpu::vulkan_instances_made();
  CHECK(before > 0);
  for (std::uint32_t i = 0; i < 200; ++i) {
    const auto gpu = open_without_validation();
    if (i % 20 == 0) CHECK(fills(*gpu, i));
    if (i % 50 == 0) CHECK_FALSE(gpu::list_devices().empty());
  }
  CHECK(gpu::vulkan_instances_made() == before);
}

TEST_CASE("threads that request the first instance at the same time get the same one", "[instance]") {
  if (!open_without_validation()) return;
  const std::size_t before = gpu::vulkan_instances_made();
  constexpr int kThreads = 4;
  std::barrier all_there(kThreads);
  std::atomic<int> good = 0;
  std::vector<std::thread> threads;
  for (int t = 0; t < kThreads; ++t)
    threads.emplace_back([&, t] {
      all_there.arrive_and_wait();
      // Nothing else in this program requests this list of extensions.
      const auto instance = gpu::borrow_instance(false, {VK_KHR_GET_PHYSICAL_DEVICE_PROPERTIES_2_EXTENSION_NAME});
      const auto gpu = open_without_validation();
      if (!instance->physical_devices().empty() && fills(*gpu, static_cast<std::uint32_t>(t))) ++good;
    });
  for (std::thread& thread : threads) thread.join();
  CHECK(good == kThreads);
  CHECK(gpu::vulkan_instances_made() == before + 1);
}

TEST_CASE("a validation message reaches only the device that caused it", "[instance]") {
  const gpu::DeviceOptions options = test::device_options();
  if (options.backend != "vulkan" || !options.validation) return;
  {
    const auto first = test::open_own_device(), second = test::open_own_device();
    make_a_mistake(*second);
    CHECK(first->validation_messages().empty());
    CHECK(second->validation_messages().size() == 1);
  }
  // Later devices reuse the same instances. They start without messages, and the layer reports known messages again.
  const std::size_t before = gpu::vulkan_instances_made();
  for (int i = 0; i < 20; ++i) {
    const auto gpu = test::open_own_device();
    CHECK(gpu->validation_messages().empty());
    make_a_mistake(*gpu);
    CHECK(gpu->validation_messages().size() == 1);
  }
  CHECK(gpu::vulkan_instances_made() == before);
}
