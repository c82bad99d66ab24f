// Tests the random thresholds of shaders/visibility.comp: triangles are visible with the probabilities of volume
// rendering.
#include <catch2/catch.hpp>

#include <cmath>

#include "args/count_visible.h"
#include "common/host.h"
#include "gpu/small_scene.h"

using namespace trisoup;
using test::SmallScene;

namespace {

/// Creates triangles that fill the image, one behind another. opacity: [triangles]; order: from the camera, at x = 1,
/// to the back.
void fill_picture(SmallScene& s, const std::vector<double>& opacity, const std::vector<int>& order) {
  std::vector<glm::vec3> vertices(3 * opacity.size());
  std::vector<float> logits(24 * opacity.size(), 0.0f);
  for (std::size_t place = 0; place < order.size(); ++place) {
    const float x = 0.3f - 0.1f * static_cast<float>(place);
    const std::size_t t = order[place];
    vertices[3 * t] = {x, -9, -9}, vertices[3 * t + 1] = {x, 9, -9}, vertices[3 * t + 2] = {x, 0, 18};
    for (int k = 0; k < 3; ++k)
      logits[(3 * t + k) * 8 + 7] = static_cast<float>(std::log(opacity[t] / (1 - opacity[t])));
  }
  s.gpu.upload(s.soup.vertices.address(), vertices);
  s.gpu.upload(s.soup.source.address(), logits);
  s.step.sum_textures();
}

}  // namespace

TEST_CASE("a triangle is visible with the probability of volume rendering", "[opacity]") {
  auto gpu = test::open_device();
  const std::vector<double> opacity{0.3, 0.6, 0.05, 0.8, 0.5};
  const std::vector<int> order{3, 0, 2, 4, 1};
  const auto triangles = static_cast<std::uint32_t>(opacity.size());
  std::vector<train::BatchView> views{test::view_from(0, 16, 16), test::view_from(0, 9, 13)};
  views[1].index = 7;
  SmallScene s(*gpu, triangles, {{0, 0}}, views);
  fill_picture(s, opacity, order);
  const gpu::Buffer counts = gpu->allocate(triangles * 4, "counts");
  gpu->fill(counts.address(), counts.bytes(), 0);
  const std::uint32_t pixels = s.buffers.batch().pixels;
  constexpr std::uint32_t kSteps = 400;
  for (std::uint32_t i = 0; i < kSteps; ++i) {
    s.step.begin(f32::hash32(i), i, 0, {});
    s.step.visibility(train::Thresholds::random, s.inputs);
    gpu->launch({"count_visible", {0}}, (pixels + 63) / 64,
                kernels::CountVisibleArgs{s.buffers.hits.address(), counts.address(), 0, pixels, 0});
  }
  const auto won = gpu->download_vector<std::uint32_t>(counts.address(), triangles);
  const double draws = double(pixels) * kSteps;
  double through = 1, chi = 0, empty = draws;
  for (const int t : order) {
    const double expected = draws * through * opacity[t];
    chi += (won[t] - expected) * (won[t] - expected) / expected;
    through *= 1 - opacity[t];
    empty -= won[t];
  }
  chi += (empty - draws * through) * (empty - draws * through) / (draws * through);
  CAPTURE(chi, draws);
  CHECK(chi < 5 + 5 * std::sqrt(2 * 5.0));  // five degrees of freedom: mean plus five standard deviations
  test::require_silence(*gpu);
}

TEST_CASE("thresholds differ between steps, views and pixels, and are reproducible", "[opacity]") {
  auto gpu = test::open_device();
  std::vector<train::BatchView> views{test::view_from(0, 32, 32), test::view_from(0, 32, 32)};
  views[1].index = 1;
  SmallScene s(*gpu, 1, {{0, 0}}, views);
  fill_picture(s, {0.5}, {0});
  const auto draw = [&](std::uint32_t key) {
    s.step.begin(key, 0, 0, {});
    s.step.visibility(train::Thresholds::random, s.inputs);
    std::vector<int> shown;
    for (const kernels::Hit& hit :
         gpu->download_vector<kernels::Hit>(s.buffers.hits.address(), s.buffers.batch().pixels))
      shown.push_back(hit.triangle != 0);
    return shown;
  };
  const auto first = draw(1), again = draw(1), second = draw(2);
  CHECK(first == again);
  // Of n pairs of independent random bits, n / 2 are equal, with a standard deviation of sqrt(n) / 2.
  const auto independent = [](const std::vector<int>& a, const std::vector<int>& b) {
    double agree = 0;
    for (std::size_t i = 0; i < a.size(); ++i) agree += a[i] == b[i];
    const double n = static_cast<double>(a.size());
    return std::abs(agree - n / 2) < 4 * std::sqrt(n) / 2;
  };
  const auto middle = first.begin() + 1024;
  CHECK(independent(first, second));
  CHECK(independent({first.begin(), middle}, {middle, first.end()}));                        // the two views
  CHECK(independent({first.begin(), first.end() - 1}, {first.begin() + 1, first.end()}));    // horizontal neighbours
  CHECK(independent({first.begin(), first.end() - 32}, {first.begin() + 32, first.end()}));  // vertical neighbours
  test::require_silence(*gpu);
}
