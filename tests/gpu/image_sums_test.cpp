// Tests engine/train/quality/image_sums.h (shaders/image_metrics.comp) against compare() in double on the host.
#include <catch2/catch.hpp>

#include <cmath>

#include "gpu/small_scene.h"
#include "train/quality/image_sums.h"
#include "train/step/photographs.h"

using namespace trisoup;

TEST_CASE("metrics of the device match those of the host", "[image_metrics][each_driver]") {
  auto gpu = test::open_device();
  soup::Random random(11);
  const glm::vec3 background(1.0f);
  // Sizes that are not multiples of a block, one too small for an SSIM window, and one with almost no error.
  struct Case {
    int width, height;
    bool masked, close;
  };
  const std::vector<Case> cases{
      {53, 41, false, false}, {64, 33, true, false}, {9, 40, false, false}, {48, 32, false, true}};
  std::vector<train::BatchView> views;
  for (std::uint32_t v = 0; v < cases.size(); ++v) {
    views.push_back(test::view_from(1.3 * v, static_cast<std::uint32_t>(cases[v].width),
                                    static_cast<std::uint32_t>(cases[v].height)));
    views.back().index = v;
  }
  test::SmallScene s(*gpu, 30, {{2, 3}, {0, 0}}, views);
  train::StepInputs inputs;
  inputs.background = background;
  const auto render = [&] {
    s.buffers.set_batch(views, s.soup.triangles, false);
    s.step.visibility(train::Thresholds::half, inputs);
    s.step.shade(inputs);
  };
  render();
  const std::vector<float> colour =
      gpu->download_vector<float>(s.buffers.colour.address(), 3ull * s.buffers.batch().pixels);
  const auto hits = gpu->download_vector<kernels::Hit>(s.buffers.hits.address(), s.buffers.batch().pixels);

  std::vector<Image> photographs;
  for (std::uint32_t v = 0; v < cases.size(); ++v) {
    Image image{cases[v].width, cases[v].height, {}};
    const std::uint32_t offset = s.buffers.batch().records[v].pixel_offset;
    for (std::uint32_t p = 0; p < views[v].width * views[v].height; ++p)
      for (std::uint32_t c = 0; c < 4; ++c) {
        const float noise = cases[v].close ? 2.0f * random.uniform01() : 160.0f * random.uniform01();
        // A third of the pixels equals the background, and a third is darker than the rendering.
        const float shown = c == 3 ? 0.0f : 255.0f * colour[3 * (offset + p) + c], third = cases[v].close ? 2 : p % 3;
        const float value = c == 3       ? (cases[v].masked && p % 5 == 0 ? 90.0f : 255.0f)
                            : third == 0 ? 249.0f
                            : third == 1 ? 0.5f * shown
                                         : std::min(255.0f, shown + noise);
        image.rgba.push_back(static_cast<std::uint8_t>(value));
      }
    photographs.push_back(std::move(image));
  }
  const train::Photographs uploaded = train::upload_photographs(*gpu, photographs);
  for (std::size_t v = 0; v < views.size(); ++v) views[v].photo = uploaded.addresses[v];
  render();
  s.step.photographs(inputs);
  const std::vector<train::ImageSums> sums = train::sum_images(*gpu, s.buffers, background, train::Ssim::whole_windows);
  const std::vector<train::ImageSums> again = train::sum_images(*gpu, s.buffers, background, train::Ssim::none);
  const std::vector<train::ImageSums> centred =
      train::sum_images(*gpu, s.buffers, background, train::Ssim::centred_in_mask);
  REQUIRE(sums.size() == cases.size());
  for (std::size_t v = 0; v < cases.size(); ++v) {
    CAPTURE(v);
    const kernels::ViewRecord& record = s.buffers.batch().records[v];
    const std::size_t first = record.pixel_offset, count = std::size_t(record.width) * record.height;
    const train::ImageMetrics host = train::compare(std::span(colour).subspan(3 * first, 3 * count), photographs[v]);
    const train::ImageMetrics device = train::metrics_of(sums[v]);
    CHECK(std::abs(device.psnr - host.psnr) < 1e-4);
    if (v == 2)  // smaller than a window
      CHECK((std::isnan(device.ssim) && std::isnan(host.ssim)));
    else
      CHECK(std::abs(device.ssim - host.ssim) < 1e-5);
    CHECK(std::abs(device.mae - host.mae) < 1e-6);
    CHECK(device.pixels == host.pixels);
    std::size_t uncovered = 0;
    for (std::size_t p = 0; p < count; ++p) {
      const std::uint8_t* rgba = &photographs[v].rgba[4 * p];
      uncovered += rgba[3] >= 128 && hits[first + p].triangle == 0 && (rgba[0] < 247 || rgba[1] < 247 || rgba[2] < 247);
    }
    CHECK(sums[v].uncovered == uncovered);
    CHECK(again[v].squares == sums[v].squares);
    CHECK(again[v].ssim == 0);
    // Complete windows, and those whose central pixel is inside the mask.
    std::uint64_t windows = 0, inside = 0;
    for (int y = 5; y < cases[v].height - 5; ++y)
      for (int x = 5; x < cases[v].width - 5; ++x, ++windows)
        inside += photographs[v].rgba[4 * std::size_t(y * cases[v].width + x) + 3] >= 128;
    CHECK(sums[v].windows == windows);
    CHECK(centred[v].windows == inside);
    CHECK(centred[v].pixels == sums[v].pixels);
    CHECK(centred[v].squares == sums[v].squares);
    CHECK((centred[v].ssim == sums[v].ssim) == (inside == windows));
  }
  CHECK(sums[1].pixels < 64 * 33);
  CHECK(sums[0].uncovered > 0);
  CHECK(train::metrics_of(sums[3]).psnr > 40);
  test::require_silence(*gpu);
}

TEST_CASE("a completely masked image has no metrics", "[image_metrics]") {
  train::ImageSums none;
  none.windows = 100;
  CHECK(train::metrics_of(none).pixels == 0);
  CHECK(train::metrics_of(none).psnr == 0);
  CHECK(none.share_uncovered() == 0);
}
