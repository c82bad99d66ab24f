// Tests the learning rates of shaders/update_vertices.comp.
#include <catch2/catch.hpp>

#include <cmath>
#include <vector>

#include "args/update_vertices.h"
#include "common/host.h"
#include "draws.h"
#include "gpu/small_scene.h"
#include "train/step/fixed_sum.h"

using namespace trisoup;

namespace {

constexpr float kRate = 0.01f;

/// Moves a triangle by one update whose gradient is 1 along x, and returns by how much each vertex moved. Adam's first
/// step has the length of the learning rate.
std::vector<float> moves(gpu::Device& gpu, const std::vector<float>& vertices, float full_side,
                         const std::vector<float>& eyes, float full_distance, float still_beyond = 0) {
  const auto buffer = [&](const auto& values, const char* name) {
    gpu::Buffer b = gpu.allocate(values.size() * sizeof(values[0]), name);
    gpu.upload(b.address(), values);
    return b;
  };
  constexpr std::uint32_t kUnit = 1u << 12;  // of a gradient's high word: 2^44 / 2^32
  const gpu::Buffer at = buffer(vertices, "vertices"), moment1 = buffer(std::vector<float>(9), "moment 1"),
                    moment2 = buffer(std::vector<float>(3), "moment 2"),
                    low = buffer(std::vector<std::uint32_t>(9, train::kFixedZero), "low words"),
                    high = buffer(std::vector<std::uint32_t>{kUnit, 0, 0, kUnit, 0, 0, kUnit, 0, 0}, "high words"),
                    positions = buffer(eyes.empty() ? std::vector<float>(3) : eyes, "eyes");
  kernels::StepState state{};
  state.lr_vertex = kRate / 0.1f, state.second_vertex = 1.0f / std::sqrt(0.001f);
  const gpu::Buffer states = buffer(std::vector{state}, "state"),
                    control = buffer(std::vector{kernels::Control{}}, "control");
  gpu.launch(
      {"update_vertices", {0}}, 1,
      kernels::UpdateVerticesArgs{at.address(), moment1.address(), moment2.address(), low.address(), high.address(),
                                  states.address(), control.address(), 0, positions.address(), 1, full_side,
                                  static_cast<std::uint32_t>(eyes.size() / 3), full_distance, still_beyond, 0});
  const auto after = gpu.download_vector<float>(at.address(), 9);
  std::vector<float> result;
  for (std::size_t k = 0; k < 3; ++k) result.push_back(vertices[3 * k] - after[3 * k]);
  return result;
}

}  // namespace

TEST_CASE("vertices near a camera and of small triangles have lower learning rates, far ones can be still", "[step]") {
  auto gpu = test::open_device();
  // Equilateral, of side 0.2; its corners are 0.1, 0.3 and about 0.26 from the first camera.
  const float height = 0.2f * std::sqrt(0.75f);
  const std::vector<float> triangle{0, 0, 0, 0.2f, 0, 0, 0.1f, height, 0}, eyes{-0.1f, 0, 0, 5, 5, 5};
  const auto close_to = [](const std::vector<float>& a, const std::vector<float>& b) {
    for (std::size_t k = 0; k < 3; ++k) CHECK(a[k] == Approx(b[k]).epsilon(2e-3));
  };
  close_to(moves(*gpu, triangle, 0, {}, 0), {kRate, kRate, kRate});
  close_to(moves(*gpu, triangle, 0.4f, {}, 0), {kRate / 2, kRate / 2, kRate / 2});
  close_to(moves(*gpu, triangle, 0.1f, {}, 0), {kRate, kRate, kRate});
  const float third = std::hypot(0.2f, height);
  close_to(moves(*gpu, triangle, 0, eyes, 0.5f), {kRate * 0.2f, kRate * 0.6f, kRate * 2 * third});
  close_to(moves(*gpu, triangle, 0, eyes, 0.2f), {kRate * 0.5f, kRate, kRate});
  close_to(moves(*gpu, triangle, 0.4f, eyes, 0.2f), {kRate * 0.25f, kRate / 2, kRate / 2});
  CHECK(moves(*gpu, triangle, 0, {}, 0, 0.19f)[0] == Approx(kRate).epsilon(2e-3));
  CHECK(moves(*gpu, triangle, 0, {}, 0, 0.19f)[1] == 0);
  test::require_silence(*gpu);
}
