// Tests shaders/common/fixed_point.h and block_sums.h through kernels that use them: sums match double precision and do
// not depend on the order of their terms.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/host.h"
#include "gpu/small_scene.h"
#include "lattice_gradient.h"

using namespace trisoup;
using test::SmallScene;

namespace {

struct Words {
  std::vector<std::uint32_t> low, high;
};

Words download(gpu::Device& gpu, const train::FixedSums& sums, std::size_t count) {
  return {gpu.download_vector<std::uint32_t>(sums.low.address(), count),
          gpu.download_vector<std::uint32_t>(sums.high.address(), count)};
}

void forward_and_backward(SmallScene& s, train::Thresholds thresholds) {
  s.step.begin(3, 0, 0, {});
  s.step.visibility(thresholds, s.inputs);
  s.step.shade(s.inputs);
  s.step.loss(s.inputs);
  s.step.backward(s.inputs);
}

}  // namespace

TEST_CASE("a sum of thousands of positive and negative terms matches double precision", "[fixed point]") {
  auto gpu = test::open_device();
  // One triangle covers the whole image, so its three samples sum the terms of 3,072 pixels.
  SmallScene s(*gpu, 1, {{0, 0}}, {test::view_from(0, 64, 48)});
  gpu->upload(s.soup.vertices.address(), std::vector<glm::vec3>{{0, -9, -9}, {0, 9, -9}, {0, 0, 18}});
  gpu->upload(s.soup.source.address(), std::vector<float>(24, 1.0f));
  s.step.sum_textures();
  const std::size_t pixels = s.buffers.batch().pixels;
  const gpu::Buffer seen = gpu->allocate(pixels * 28, "feature gradient");
  s.inputs.probes.feature_gradient = seen.address();
  const gpu::Buffer sums = gpu->allocate(3 * 32, "texture gradient");
  s.inputs.probes.source_gradient = sums.address();
  const auto lattice = gpu->download_vector<float>(s.soup.lattice.address(), 24);

  // Single terms are clamped to 64. The largest terms here are close to that.
  for (const float size : {1e-7f, 1e-3f, 1.0f, 40.0f}) {
    for (const float bias : {0.0f, 0.3f, -0.3f}) {
      CAPTURE(size, bias);
      soup::Random random(9);
      s.step.begin(1, 0, 0, {});
      s.step.visibility(train::Thresholds::half, s.inputs);
      s.step.shade(s.inputs);
      s.step.loss(s.inputs);
      std::vector<float> gradient(4 * pixels, 0.0f);  // channel 3, the L1 error, is 0, so opacity has no gradient
      for (std::size_t i = 0; i < gradient.size(); ++i)
        if (i % 4 != 3) gradient[i] = size * (random.uniform(-1, 1) + bias);
      gpu->upload(s.buffers.gradient.address(), gradient);
      s.step.backward(s.inputs);

      const auto hits = gpu->download_vector<kernels::Hit>(s.buffers.hits.address(), pixels);
      const auto terms = gpu->download_vector<float>(seen.address(), 7 * pixels);
      double expected[3][7] = {}, magnitude[3][7] = {}, largest = 0;
      for (const float term : terms) largest = std::max(largest, std::abs(double(term)));
      for (std::size_t p = 0; p < pixels; ++p) {
        REQUIRE(hits[p].triangle == 1);
        const f32::LatticeCell cell = f32::lattice_cell(hits[p].b0, hits[p].b1, 0);
        for (const auto& [sample, weight] : {std::pair(cell.i0, cell.w0), {cell.i1, cell.w1}, {cell.i2, cell.w2}})
          for (int c = 0; c < 7; ++c) {
            const double term = double(weight) * terms[7 * p + c];
            expected[sample][c] += term;
            magnitude[sample][c] += std::abs(term);
          }
      }
      s.step.update(s.inputs);  // learning rates are 0
      const auto actual = gpu->download_vector<float>(sums.address(), 24);
      for (int k = 0; k < 3; ++k)
        for (int c = 0; c < 7; ++c) {
          const double value = lattice[k * 8 + c], slope = value * (1 - value);
          // Error bound: half an ulp of every float term, plus half a unit per term. A unit is at most 2^-29 times
          // 3,072 times the largest term.
          CHECK(std::abs(actual[k * 8 + c] - slope * expected[k][c]) <=
                slope * (2e-7 * magnitude[k][c] + 0.5 * 3072 * 3072 * 0x1p-29 * largest));
        }
    }
  }
  test::require_silence(*gpu);
}

TEST_CASE("terms beyond the limit saturate, so that sums keep their sign", "[fixed point]") {
  auto gpu = test::open_device();
  SmallScene s(*gpu, 1, {{0, 0}}, {test::view_from(0, 64, 48)});
  gpu->upload(s.soup.vertices.address(), std::vector<glm::vec3>{{0, -9, -9}, {0, 9, -9}, {0, 0, 18}});
  gpu->upload(s.soup.source.address(), std::vector<float>(24, 1.0f));
  s.step.sum_textures();
  const float sign = GENERATE(1.0f, -1.0f);
  forward_and_backward(s, train::Thresholds::half);
  std::vector<float> gradient(4ull * s.buffers.batch().pixels, sign * 1e12f);
  for (std::size_t i = 3; i < gradient.size(); i += 4) gradient[i] = 0;
  gpu->upload(s.buffers.gradient.address(), gradient);
  const gpu::Buffer sums = gpu->allocate(3 * 32, "texture gradient");
  s.inputs.probes.source_gradient = sums.address();
  s.step.backward(s.inputs);
  s.step.update(s.inputs);
  const auto actual = gpu->download_vector<float>(sums.address(), 24);
  for (int k = 0; k < 3; ++k)
    for (int c = 0; c < 3; ++c)  // the base colour has a positive weight
      CHECK(sign * actual[k * 8 + c] > 1e3);
  test::require_silence(*gpu);
}

TEST_CASE("a 64-bit sum of thousands of positive and negative terms matches double precision", "[fixed point]") {
  auto gpu = test::open_device();
  // Opacity gradients use the error of a pixel minus the mean error of its neighbours.
  SmallScene s(*gpu, 1, {{0, 0}}, {test::view_from(0, 64, 48)});
  gpu->upload(s.soup.vertices.address(), std::vector<glm::vec3>{{0, -9, -9}, {0, 9, -9}, {0, 0, 18}});
  gpu->upload(s.soup.source.address(), std::vector<float>(24, 1.0f));
  s.step.sum_textures();
  s.inputs.opacity_baseline = true;
  constexpr int kWidth = 64, kHeight = 48;
  const double alpha = 1 / (1 + std::exp(-1.0)), weight = 1.0 / (3.0 * kWidth * kHeight);
  for (const float size : {1e-7f, 1e-3f, 1.0f, 60.0f, 1e12f}) {
    CAPTURE(size);
    soup::Random random(9);
    train::clear(*gpu, s.soup.opacity_gradient);
    s.step.begin(1, 0, 0, {});
    s.step.visibility(train::Thresholds::half, s.inputs);
    s.step.shade(s.inputs);
    s.step.loss(s.inputs);
    std::vector<float> gradient(4ull * kWidth * kHeight, 0.0f);
    for (std::size_t i = 3; i < gradient.size(); i += 4)
      gradient[i] = random.uniform(0, 1) * size * static_cast<float>(alpha / weight);
    gpu->upload(s.buffers.gradient.address(), gradient);
    s.step.backward(s.inputs);

    const auto hits = gpu->download_vector<kernels::Hit>(s.buffers.hits.address(), std::size_t(kWidth) * kHeight);
    double expected[3] = {}, magnitude[3] = {};
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        const auto error = [&](int column, int row) {
          return double(gradient[4ull * (std::size_t(row) * kWidth + std::size_t(column)) + 3]);
        };
        double sum = 0;
        int count = 0;
        for (int v = std::max(0, y - 1); v <= std::min(kHeight - 1, y + 1); ++v)
          for (int u = std::max(0, x - 1); u <= std::min(kWidth - 1, x + 1); ++u)
            if (u != x || v != y) sum += error(u, v), ++count;
        const double term = (error(x, y) - sum / count) * weight / alpha;
        const kernels::Hit& hit = hits[std::size_t(y) * kWidth + std::size_t(x)];
        REQUIRE(hit.triangle == 1);
        const f32::LatticeCell cell = f32::lattice_cell(hit.b0, hit.b1, 0);
        for (const auto& [sample, w] : {std::pair(cell.i0, cell.w0), {cell.i1, cell.w1}, {cell.i2, cell.w2}}) {
          const double part = std::clamp(double(w) * term, -64.0, 64.0);  // single terms are clamped
          expected[sample] += part;
          magnitude[sample] += std::abs(part);
        }
      }
    const Words words = download(*gpu, s.soup.opacity_gradient, 3);
    for (int k = 0; k < 3; ++k) {
      CAPTURE(k, expected[k], magnitude[k]);
      CHECK(std::abs(train::fixed_sum(words.low[k], words.high[k]) - expected[k]) <=
            2e-6 * magnitude[k] + kWidth * kHeight * 0x1p-44);
      if (size < 1e12f) CHECK(std::abs(expected[k]) < 0.2 * magnitude[k]);  // terms of both signs
    }
  }
  test::require_silence(*gpu);
}

TEST_CASE("gradients have the same bits for any order of the triangles", "[fixed point]") {
  auto gpu = test::open_device();
  constexpr std::uint32_t kTriangles = 50;
  const std::vector<train::BatchView> views{test::view_from(0, 48, 40), test::view_from(2, 33, 47)};
  SmallScene a(*gpu, kTriangles, {{0, 3}}, views), b(*gpu, kTriangles, {{0, 3}}, views);
  a.buffers.reserve_lists(1 << 16);
  b.buffers.reserve_lists(1 << 16);

  std::vector<std::uint32_t> order(kTriangles);
  std::iota(order.begin(), order.end(), 0u);
  soup::Random(5).shuffle(std::span(order));
  const auto permuted = [&](const auto& values) {
    auto out = values;
    const std::size_t n = values.size() / kTriangles;
    for (std::uint32_t t = 0; t < kTriangles; ++t) std::copy_n(values.begin() + order[t] * n, n, out.begin() + t * n);
    return out;
  };
  gpu->upload(b.soup.vertices.address(),
              permuted(gpu->download_vector<float>(a.soup.vertices.address(), 9 * kTriangles)));
  gpu->upload(b.soup.source.address(), permuted(a.logits));
  b.step.sum_textures();

  // Random thresholds would depend on the number of the triangle.
  forward_and_backward(a, train::Thresholds::half);
  forward_and_backward(b, train::Thresholds::half);
  CHECK(permuted(test::lattice_quanta(*gpu, a.soup, a.buffers)) == test::lattice_quanta(*gpu, b.soup, b.buffers));
  const Words wa = download(*gpu, a.soup.vertex_gradient, 9 * kTriangles),
              wb = download(*gpu, b.soup.vertex_gradient, 9 * kTriangles);
  CHECK(permuted(wa.low) == wb.low);
  CHECK(permuted(wa.high) == wb.high);
  CHECK(std::any_of(wa.high.begin(), wa.high.end(),
                    [](std::uint32_t w) { return w != 0; }));  // otherwise the test proves little
  const std::size_t partial = std::uint64_t{soup::Mlp::kParameters} * a.buffers.mlp_groups;
  CHECK(gpu->download_vector<std::uint32_t>(a.buffers.mlp_partial.address(), partial) ==
        gpu->download_vector<std::uint32_t>(b.buffers.mlp_partial.address(), partial));
  std::vector<std::uint32_t> gradients[2];
  for (const auto& [scene, gradient] : {std::pair(&a, &gradients[0]), {&b, &gradients[1]}}) {
    const gpu::Buffer seen = gpu->allocate(scene->soup.source_samples * 32, "texture gradient");
    scene->inputs.probes.source_gradient = seen.address();
    scene->step.update(scene->inputs);
    *gradient = gpu->download_vector<std::uint32_t>(seen.address(), scene->soup.source_samples * 8);
  }
  CHECK(permuted(gradients[0]) == gradients[1]);
  test::require_silence(*gpu);
}
