// A small scene for tests on a device: a few triangles and cameras, with the validation layers enabled.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <memory>
#include <optional>
#include <vector>

#include <catch2/catch.hpp>

#include "gpu/device.h"
#include "scene/camera.h"
#include "soup/random.h"
#include "soup/soup.h"
#include "soup/texture_table.h"
#include "train/step/batch_buffers.h"
#include "train/step/fixed_sum.h"
#include "train/step/forward_pass.h"
#include "train/step/shared_soup.h"
#include "train/step/soup_buffers.h"
#include "train/step/step.h"
#include "train/step/step_queue.h"

namespace trisoup::test {

/// Options of the device under test, from TRISOUP_BACKEND and TRISOUP_DEVICE. Default: the best Vulkan device.
inline gpu::DeviceOptions device_options() {
  gpu::DeviceOptions options;
  const char* const backend = std::getenv("TRISOUP_BACKEND");
  options.backend = backend ? backend : "vulkan";
  if (const char* name = std::getenv("TRISOUP_DEVICE")) options.device = name;
  options.validation = !std::getenv("TRISOUP_NO_VALIDATION");  // for machines without the layers
  return options;
}

/// The device under test. All tests of a process share it, because some drivers compile each kernel anew on each
/// device.
inline gpu::Device* open_device() {
  static const std::unique_ptr<gpu::Device> device = gpu::open_device(device_options());
  return device.get();
}

/// A device of its own: for each thread of a test that has several, and for tests that change the state of a device. It
/// is lost after so many launches; 0: never.
inline std::unique_ptr<gpu::Device> open_own_device(std::uint64_t lose_after = 0) {
  gpu::DeviceOptions options = device_options();
  options.lose_after_launches = lose_after;
  return gpu::open_device(options);
}

/// Fails the test if the validation layers reported any message.
inline void require_silence(const gpu::Device& gpu) {
  for (const std::string& message : gpu.validation_messages()) FAIL_CHECK(message);
}

/// Camera at distance 1 from the origin in the xy plane, looking at it.
inline train::BatchView view_from(double angle, std::uint32_t width, std::uint32_t height) {
  scene::Camera camera;
  camera.width = static_cast<int>(width);
  camera.height = static_cast<int>(height);
  camera.fx = camera.fy = 1.2 * std::max(width, height);
  camera.cx = 0.5 * width;
  camera.cy = 0.5 * height;
  const glm::dvec3 z(-std::cos(angle), -std::sin(angle), 0), y(0, 0, -1), x = glm::cross(y, z);
  const glm::dmat4 world_from_camera(glm::dvec4(x, 0), glm::dvec4(y, 0), glm::dvec4(z, 0), glm::dvec4(-z, 1));
  camera.world_to_camera = glm::inverse(world_from_camera);
  return train::batch_view(camera, 0.025, 2.5);
}

/// A random soup with random logits in a box with half side 0.3.
struct SmallScene {
  SmallScene(gpu::Device& device, std::uint32_t triangles, std::vector<soup::TextureLevels> levels,
             std::vector<train::BatchView> batch, std::uint64_t seed = 1, ranks::Ranks* ranks = nullptr)
      : gpu(device), buffers(device, 8), step(device, soup, buffers), views(std::move(batch)) {
    if (ranks) shared.emplace(gpu, soup, buffers, *ranks);
    soup::Random random(seed);
    std::vector<glm::vec3> vertices;
    for (std::uint32_t t = 0; t < triangles; ++t) {
      const glm::vec3 centre{random.uniform(-0.25, 0.25), random.uniform(-0.25, 0.25), random.uniform(-0.25, 0.25)};
      for (int k = 0; k < 3; ++k)
        vertices.push_back(centre +
                           glm::vec3{random.uniform(-0.2, 0.2), random.uniform(-0.2, 0.2), random.uniform(-0.2, 0.2)});
    }
    levels.resize(triangles, levels.back());
    const soup::TextureTable table = soup::make_texture_table(levels);
    train::allocate_soup(gpu, soup, vertices, table.entries);
    logits.resize(table.source_samples * 8);
    for (float& v : logits) v = static_cast<float>(random.uniform(-1.5, 1.5));
    const std::uint64_t first = 8 * soup.source_at(soup.own().first), last = 8 * soup.source_at(soup.own().last);
    if (last > first) gpu.upload(soup.source.address(), std::as_bytes(std::span(logits).subspan(first, last - first)));
    train::allocate_mlp(gpu, soup, train::initial_mlp(seed));
    buffers.set_batch(views, triangles, true);
    std::vector<float> values(3ull * buffers.batch().pixels);
    for (float& v : values) v = random.uniform01();
    target = gpu.allocate(values.size() * 4, "target");
    gpu.upload(target.address(), values);
    inputs.target = target.address();
    step.sum_textures();
  }

  void train(std::uint32_t i, const train::Rates& rates) {
    step.begin(i * 7919u + 1u, i, i % train::BatchBuffers::kStatisticsRows, rates);
    step.train(inputs);
  }
  static train::Rates rates(std::uint32_t i) { return {5e-2, 2.5e-4, 1e-2, i + 1, i + 1, i + 1}; }

  /// Returns all parameters and moments, of all ranks.
  std::vector<float> state() {
    const std::uint64_t vertices = 3ull * soup.triangles, textures = soup.source_samples * 8,
                        mlp = soup::Mlp::kParameters;
    std::vector<float> all;
    const auto add = [&](const std::vector<float>& values) { all.insert(all.end(), values.begin(), values.end()); };
    for (const auto& [buffer, n] : {std::pair(&soup.vertices, 3 * vertices),
                                    {&soup.vertex_moment1, 3 * vertices},
                                    {&soup.vertex_moment2, vertices},
                                    {&soup.mlp, mlp},
                                    {&soup.mlp_moment1, mlp},
                                    {&soup.mlp_moment2, mlp}})
      add(gpu.download_vector<float>(buffer->address(), n));
    for (const gpu::Buffer* pool : {&soup.source, &soup.source_moment1, &soup.source_moment2})
      add(shared ? shared->all_values(*pool) : gpu.download_vector<float>(pool->address(), textures));
    return all;
  }

  gpu::Device& gpu;
  train::SoupBuffers soup;
  train::BatchBuffers buffers;
  std::optional<train::SharedSoup> shared;
  train::Step step;
  train::StepInputs inputs;
  gpu::Buffer target;
  std::vector<float> logits;
  std::vector<train::BatchView> views;
};

}  // namespace trisoup::test
