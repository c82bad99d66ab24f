// Stability of shaders/visibility.comp and opacity_backward.comp with opacities at their limits and with many layers in
// one pixel: the gradient matches exact enumeration, is finite, and is bounded.
#include <catch2/catch.hpp>

#include <cmath>
#include <numeric>

#include "common/host.h"
#include "gpu/small_scene.h"

using namespace trisoup;
using test::SmallScene;

namespace {

constexpr std::uint32_t kSide = 8, kPixels = kSide * kSide;

/// Layers that fill the picture, front to back, each with one grey value and one opacity.
struct Layers {
  std::vector<double> logit, grey;
};

/// Gradients of the mean L1 error with respect to the logits: exact values from volume rendering, and the kernels' mean
/// over draws of thresholds.
struct Gradients {
  std::vector<double> opacity, exact, mean, error;  // error: standard error of mean
  double largest = 0;                               // of any layer in any draw
  std::vector<double> same_draws;  // mean on the CPU for the same draws; empty unless a driver was measured
};

Gradients measure_on(gpu::Device& device, const Layers& layers, int samples, bool baseline) {
  gpu::Device* const gpu = &device;
  const auto n = static_cast<std::uint32_t>(layers.logit.size());
  SmallScene s(*gpu, n, {{0, 0}}, {test::view_from(0, kSide, kSide)});
  s.buffers.reserve_lists(std::uint64_t(n) * s.buffers.batch().tiles);
  std::vector<glm::vec3> vertices;
  std::vector<float> logits(24 * n, 0.0f);
  for (std::uint32_t t = 0; t < n; ++t) {
    const float x = 0.3f - 0.6f * static_cast<float>(t) / static_cast<float>(n);  // the camera is at x = 1
    vertices.insert(vertices.end(), {{x, -9, -9}, {x, 9, -9}, {x, 0, 18}});
    for (std::uint32_t k = 0; k < 3; ++k) {
      float* sample = &logits[(3 * t + k) * 8];
      for (int c = 0; c < 3; ++c) sample[c] = static_cast<float>(std::log(layers.grey[t] / (1 - layers.grey[t])));
      sample[3] = -30.0f;  // no MLP
      sample[7] = static_cast<float>(layers.logit[t]);
    }
  }
  gpu->upload(s.soup.vertices.address(), vertices);
  gpu->upload(s.soup.source.address(), logits);
  s.step.sum_textures();
  const double background = 0.7;
  s.inputs.background = glm::vec3(static_cast<float>(background));
  s.inputs.opacity_baseline = baseline;
  const auto target = gpu->download_vector<float>(s.target.address(), 3 * kPixels);
  const auto lattice = gpu->download_vector<float>(s.soup.opacity.address(), 3 * n);

  Gradients g;
  for (std::uint32_t t = 0; t < n; ++t) g.opacity.push_back(lattice[3 * t]);
  // d/d(alpha_j) of sum_k T_k alpha_k e_k is T_j (e_j - error behind j), where T is the transmittance.
  g.exact.assign(n, 0.0);
  for (const float y : target) {
    std::vector<double> behind(n + 1), through(n + 1, 1.0);
    behind[n] = std::abs(background - y);
    for (std::uint32_t t = n; t > 0; --t)
      behind[t - 1] = g.opacity[t - 1] * std::abs(layers.grey[t - 1] - y) + (1 - g.opacity[t - 1]) * behind[t];
    for (std::uint32_t t = 0; t < n; ++t) {
      through[t + 1] = through[t] * (1 - g.opacity[t]);
      g.exact[t] += through[t] * (std::abs(layers.grey[t] - y) - behind[t + 1]) / (3.0 * kPixels) * g.opacity[t] *
                    (1 - g.opacity[t]);
    }
  }
  std::vector<double> sum(n, 0.0), squares(n, 0.0);
  for (int i = 0; i < samples; ++i) {
    train::clear(*gpu, s.soup.opacity_gradient);
    s.step.begin(f32::hash32(static_cast<std::uint32_t>(i) + 77), 0, 0, {});
    s.step.visibility(train::Thresholds::random, s.inputs);
    s.step.shade(s.inputs);
    s.step.loss(s.inputs);
    s.step.backward(s.inputs);
    const auto low = gpu->download_vector<std::uint32_t>(s.soup.opacity_gradient.low.address(), 3 * n);
    const auto high = gpu->download_vector<std::uint32_t>(s.soup.opacity_gradient.high.address(), 3 * n);
    for (std::uint32_t t = 0; t < n; ++t) {
      double value = 0;
      for (std::uint32_t k = 0; k < 3; ++k) value += train::fixed_sum(low[3 * t + k], high[3 * t + k]);
      value *= g.opacity[t] * (1 - g.opacity[t]);
      sum[t] += value;
      squares[t] += value * value;
      g.largest = std::max(g.largest, std::isfinite(value) ? std::abs(value) : INFINITY);
    }
  }
  for (std::uint32_t t = 0; t < n; ++t) {
    g.mean.push_back(sum[t] / samples);
    g.error.push_back(std::sqrt(std::max(0.0, squares[t] / samples - g.mean[t] * g.mean[t]) / samples));
  }
  test::require_silence(*gpu);
  return g;
}

/// Measures on the CPU backend. Through a driver with validation layers a launch costs a hundred times as much. There,
/// a fiftieth of the draws are compared with the same draws on the CPU, whose mean is verified.
Gradients measure(const Layers& layers, int samples, bool baseline) {
  auto gpu = test::open_device();
  if (gpu->info().backend == "cpu") return measure_on(*gpu, layers, samples, baseline);
  gpu::DeviceOptions options;
  options.backend = "cpu";
  auto cpu = gpu::open_device(options);
  Gradients g = measure_on(*gpu, layers, std::max(1, samples / 50), baseline);
  g.same_draws = measure_on(*cpu, layers, std::max(1, samples / 50), baseline).mean;
  return g;
}

/// A pixel's weight times its error over three channels is at most 1 / pixels, and alpha (1 - alpha) / max(alpha, 1e-5)
/// at most 1, so the gradient of a logit is bounded for any opacity. With a baseline an error may count twice.
void check_bounded(const Gradients& g) { CHECK(g.largest <= 1.0); }

/// For opacities closer than 1e-5 to 0 or 1, one of the two outcomes is almost never drawn. Its contribution is at most
/// 1e-5.
void check_unbiased(const Gradients& g) {
  for (std::size_t t = 0; t < g.same_draws.size(); ++t) {
    CAPTURE(t, g.mean[t], g.same_draws[t]);
    // A pixel whose threshold is within rounding of an opacity may have either outcome.
    CHECK(std::abs(g.mean[t] - g.same_draws[t]) <= 1e-3 * std::abs(g.same_draws[t]) + 1e-6);
  }
  if (!g.same_draws.empty()) return;
  for (std::size_t t = 0; t < g.mean.size(); ++t) {
    const double limit = std::min(g.opacity[t], 1 - g.opacity[t]) < 1e-5 ? 1e-5 : 0.0;
    CAPTURE(t, g.opacity[t], g.mean[t], g.exact[t], g.error[t]);
    CHECK(std::abs(g.mean[t] - g.exact[t]) <= 4 * g.error[t] + limit);
  }
}

}  // namespace

TEST_CASE("opacities of exactly 0 and 1 and saturated logits have correct gradients", "[opacity]") {
  const bool baseline = GENERATE(false, true);
  CAPTURE(baseline);
  // Logit -200 is an opacity of exactly 0, 30 of exactly 1. Nothing behind an opacity of 1 is visible.
  const Gradients g = measure(
      {{-200, -30, -0.8, 0.4, -30, 1.5, 30, 0.3, 200}, {0.2, 0.9, 0.4, 0.8, 0.1, 0.3, 0.6, 0.5, 0.2}}, 4000, baseline);
  REQUIRE(g.opacity[0] == 0);
  REQUIRE(g.opacity[6] == 1);
  check_bounded(g);
  check_unbiased(g);
  // Layers behind the opaque one, and layers that are never or always visible, have no gradient.
  for (const std::size_t t : {0u, 6u, 7u, 8u}) CHECK(g.mean[t] == 0);
  // Makes sure that the exact gradients are large enough for the test to be meaningful.
  if (g.same_draws.empty())
    for (const std::size_t t : {2u, 3u, 5u}) CHECK(std::abs(g.exact[t]) > 5 * g.error[t]);
}

TEST_CASE("saturated opacities stay near their logits while colours are learnt", "[opacity]") {
  auto gpu = test::open_device();
  SmallScene s(*gpu, 12, {{0, 0}}, {test::view_from(0, 40, 40)});
  std::vector<float> logits = s.logits;
  for (std::size_t i = 7; i < logits.size(); i += 8) logits[i] = (i / 8) % 2 ? 30.0f : -30.0f;
  gpu->upload(s.soup.source.address(), logits);
  s.step.sum_textures();
  for (std::uint32_t i = 0; i < 50; ++i) s.train(i, SmallScene::rates(i));
  const auto state = s.state();
  CHECK(std::all_of(state.begin(), state.end(), [](float v) { return std::isfinite(v); }));
  // Colours of visible triangles are learnt, and saturated opacities do not drift away.
  const auto after = gpu->download_vector<float>(s.soup.source.address(), logits.size());
  double moved = 0, opacity = 0;
  for (std::size_t i = 0; i < logits.size(); ++i)
    (i % 8 == 7 ? opacity : moved) = std::max(i % 8 == 7 ? opacity : moved, double(std::abs(after[i] - logits[i])));
  CAPTURE(moved, opacity);
  CHECK(moved > 0.1);
  CHECK(opacity <= 50 * 5e-2 * 1.1);
}

TEST_CASE("pixels in which every fragment is masked still have gradients", "[opacity]") {
  const bool baseline = GENERATE(false, true);
  CAPTURE(baseline);
  const Gradients g = measure({{-4, -3.5, -4.5}, {0.1, 0.9, 0.3}}, 4000, baseline);
  check_bounded(g);
  check_unbiased(g);
  if (g.same_draws.empty())
    for (std::size_t t = 0; t < 3; ++t) CHECK(g.error[t] < 5e-4);
  // With all layers always masked, the picture is the background, and gradients are at most one pixel's error.
  const Gradients none = measure({{-200, -30, -200}, {0.1, 0.9, 0.3}}, 20, baseline);
  check_bounded(none);
  check_unbiased(none);
}

TEST_CASE("two hundred layers in one pixel have the exact gradient", "[opacity]") {
  const bool baseline = GENERATE(false, true);
  CAPTURE(baseline);
  soup::Random r(5);
  Layers layers;
  for (int t = 0; t < 200; ++t) {
    const double opacity = r.uniform(0.003f, 0.03f);
    layers.logit.push_back(std::log(opacity / (1 - opacity)));
    layers.grey.push_back(r.uniform(0.1f, 0.9f));
  }
  const Gradients g = measure(layers, 1500, baseline);
  check_bounded(g);
  check_unbiased(g);
  if (!g.same_draws.empty()) return;
  // Sums the gradients of all layers: a bias too small to be significant in one layer would add up.
  double difference = 0, variance = 0, size = 0;
  for (std::size_t t = 0; t < 200; ++t) {
    difference += g.mean[t] - g.exact[t];
    variance += g.error[t] * g.error[t];
    size += std::abs(g.exact[t]);
  }
  CAPTURE(difference, variance, size);
  // Layers of a pixel are correlated; `variance` does not include their covariance, hence the factor 8.
  CHECK(std::abs(difference) < 8 * std::sqrt(variance));
  CHECK(size > 20 * std::sqrt(variance));
}
