// Tests views on random backgrounds: train::random_background, shaders/shade.comp and shaders/sample_photographs.comp.
#include <catch2/catch.hpp>

#include <array>
#include <cmath>
#include <set>

#include "gpu/small_scene.h"
#include "train/quality/image_sums.h"

using namespace trisoup;
using test::SmallScene;

namespace {

std::array<int, 4> bytes_of(std::uint32_t rgba) {
  return {int(rgba & 255u), int((rgba >> 8) & 255u), int((rgba >> 16) & 255u), int(rgba >> 24)};
}

/// A photograph composited on `behind` whose columns have coverages from 0 to 1, and rows random colours. The last
/// column is excluded from the loss.
std::vector<std::uint32_t> photograph_on(const std::array<int, 4>& behind, std::uint32_t side) {
  soup::Random random(5);
  std::vector<std::uint32_t> pixels;
  for (std::uint32_t y = 0; y < side; ++y) {
    const auto own = bytes_of(random.bits());
    for (std::uint32_t x = 0; x < side; ++x) {
      const double coverage = std::min(1.0, std::round(127.0 * x / (side - 2)) / 127);
      std::uint32_t rgba = x + 1 == side ? 0u : std::uint32_t(std::lround(128 + 127 * coverage)) << 24;
      for (int c = 0; c < 3; ++c)
        rgba |= std::uint32_t(std::lround(coverage * own[c] + (1 - coverage) * behind[c])) << (8 * c);
      pixels.push_back(rgba);
    }
  }
  return pixels;
}

constexpr std::uint32_t kOwn = 0xff17a05cu;

/// Two equal views of a soup with this photograph, on white; the second one is on kOwn.
struct TwoViews : SmallScene {
  TwoViews(gpu::Device& device, std::uint32_t side, const std::vector<std::uint32_t>& photograph)
      : SmallScene(device, 3, {{0, 2}}, {test::view_from(0.4, side, side), test::view_from(0.4, side, side)}),
        buffer(device.allocate(photograph.size() * 4, "photograph")) {
    inputs.background = glm::vec3(1.0f);
    inputs.target = 0;
    device.upload(buffer.address(), photograph);
    for (train::BatchView& view : views) view.photo = buffer.address();
    views[1].background = kOwn;
    buffers.set_batch(views, soup.triangles, true);
    step.begin(1, 0, 0, {});
    step.visibility(train::Thresholds::half, inputs);
    step.shade(inputs);
  }
  gpu::Buffer buffer;
};

/// Largest difference of the colours of two pictures, 8-bit levels, inside the mask.
int largest_difference(const std::vector<std::uint32_t>& a, const std::vector<std::uint32_t>& b) {
  int worst = 0;
  for (std::size_t p = 0; p < a.size(); ++p) {
    REQUIRE((a[p] >> 31) == (b[p] >> 31));
    for (int c = 0; c < 3 && a[p] >> 31 != 0; ++c)
      worst = std::max(worst, std::abs(bytes_of(a[p])[c] - bytes_of(b[p])[c]));
  }
  return worst;
}

}  // namespace

TEST_CASE("a view with its own background has the photograph and the rendering on it", "[background][each_driver]") {
  auto gpu = test::open_device();
  constexpr std::uint32_t kSide = 33;
  const auto photograph = photograph_on({255, 255, 255, 255}, kSide);
  TwoViews s(*gpu, kSide, photograph);
  s.step.loss(s.inputs);

  const std::uint32_t pixels = s.buffers.batch().pixels, half = pixels / 2;
  const auto targets = gpu->download_vector<std::uint32_t>(s.buffers.target.address(), pixels);
  const std::vector<std::uint32_t> first(targets.begin(), targets.begin() + half),
      second(targets.begin() + half, targets.end());
  CHECK(largest_difference(first, photograph) == 0);
  // Both are rounded, and the photograph's error is that of its composition on white.
  CHECK(largest_difference(second, photograph_on(bytes_of(kOwn), kSide)) <= 1);
  for (std::uint32_t y = 0; y < kSide; ++y) CHECK((second[y * kSide] & 0xffffffu) == (kOwn & 0xffffffu));

  const auto hits = gpu->download_vector<kernels::Hit>(s.buffers.hits.address(), pixels);
  const auto colour = gpu->download_vector<float>(s.buffers.colour.address(), 3ull * pixels);
  const auto gradient = gpu->download_vector<glm::vec4>(s.buffers.gradient.address(), pixels);
  std::size_t empty = 0;
  for (std::uint32_t p = 0; p < half; ++p)
    for (int c = 0; c < 3; ++c) {
      const float own = colour[3 * (half + p) + c], white = colour[3 * p + c];
      if (hits[p].triangle != 0) {
        CHECK(own == white);
        continue;
      }
      ++empty;
      CHECK((white == 1.0f && own == Approx(bytes_of(kOwn)[c] / 255.0).epsilon(1e-6)));
    }
  CHECK((empty > 100 && empty < 3 * half));
  // Where neither has anything there is no error at all, so that such blocks are skipped.
  for (std::uint32_t y = 0; y < kSide; ++y)
    if (hits[y * kSide].triangle == 0) CHECK(gradient[half + y * kSide].w == 0.0f);
  test::require_silence(*gpu);
}

TEST_CASE("where a photograph shows nothing, no triangle is missing on any background", "[background]") {
  auto gpu = test::open_device();
  constexpr std::uint32_t kSide = 24;
  const std::vector<std::uint32_t> nothing(kSide * kSide, 0x80ffffffu);
  TwoViews s(*gpu, kSide, nothing);
  s.step.photographs(s.inputs);
  const auto sums = train::sum_images(*gpu, s.buffers, s.inputs.background, train::Ssim::none);
  REQUIRE(sums.size() == 2);
  for (const train::ImageSums& view : sums) CHECK((view.pixels == kSide * kSide && view.uncovered == 0));
}

TEST_CASE("random backgrounds have every colour and the asked share", "[background]") {
  std::set<std::uint32_t> colours;
  glm::dvec3 sum(0);
  int random = 0;
  constexpr int kSteps = 1000, kViews = 5;
  for (std::uint64_t step = 0; step < kSteps; ++step)
    for (std::uint32_t index = 0; index < kViews; ++index) {
      train::BatchView view;
      view.index = index;
      CHECK(train::random_background(3, step, view, 0) == 0);
      const std::uint32_t rgba = train::random_background(3, step, view, 0.3);
      CHECK(rgba == train::random_background(3, step, view, 0.3));
      if (rgba == 0) continue;
      ++random;
      const auto bytes = bytes_of(rgba);
      CHECK(bytes[3] == 255);
      sum += glm::dvec3(bytes[0], bytes[1], bytes[2]);
      colours.insert(rgba);
    }
  CHECK(std::abs(random / double(kSteps * kViews) - 0.3) < 0.03);
  for (int c = 0; c < 3; ++c) CHECK(sum[c] / random == Approx(127.5).margin(6));
  CHECK(colours.size() > 0.99 * random);
  train::BatchView view;
  for (std::uint64_t step = 0; step < 100; ++step) CHECK(train::random_background(3, step, view, 1) != 0);
}
