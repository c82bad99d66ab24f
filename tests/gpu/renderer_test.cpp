// Tests engine/render/renderer.h against the kernels that train.
#include <catch2/catch.hpp>

#include <cmath>
#include <set>

#include "gpu/small_scene.h"
#include "render/renderer.h"
#include "train/evaluate.h"

using namespace trisoup;

namespace {

/// A random model and what the compute kernels make of it.
struct Reference {
  explicit Reference(gpu::Device& device, std::uint32_t triangles = 40)
      : gpu(device), scene(device, triangles, {{0, 0}, {2, 5}, {1, 3}, {5, 5}, {0, 1}, {2, 4}},
                           {test::view_from(0.3, 200, 144), test::view_from(2.0, 160, 160)}) {
    model = train::make_model(gpu, scene.soup, glm::vec3(1.0f, 0.5f, 0.25f), {});
    soup = train::load_model(gpu, model, {});
  }

  gpu::Device& gpu;
  test::SmallScene scene;
  soup::Model model;
  train::SoupBuffers soup;
};

struct Difference {
  std::size_t pixels = 0, ties = 0, visible = 0;
  double psnr = 0;  // of the pixels that do not tie, 8-bit against float
};

/// A tie: the two show another triangle.
Difference compare(Reference& r, render::Renderer& renderer, const render::GpuModel& drawn, const std::vector<train::BatchView>& views) {
  Difference d;
  double squares = 0;
  train::StepInputs inputs;
  inputs.background = r.model.background;
  train::Frame frame(r.gpu);
  train::for_each_batch(r.gpu, r.soup, frame, views, true, inputs, 1, [&](std::size_t first, std::size_t) {
    const std::size_t pixels = frame.batch().pixels;
    const auto hits = r.gpu.download_vector<kernels::Hit>(frame.hits.address(), pixels);
    const auto colour = r.gpu.download_vector<float>(frame.colour.address(), 3 * pixels);
    render::DrawOptions options;
    options.background = r.model.background;
    options.drop_behind = true;
    const Image image = renderer.picture(drawn, {views[first].clip_from_world, views[first].width, views[first].height}, options);
    const auto ours = renderer.hits();
    for (std::size_t p = 0; p < pixels; ++p) {
      ++d.pixels;
      d.visible += hits[p].triangle != 0;
      if (ours[p].x != hits[p].triangle) {
        ++d.ties;
        continue;
      }
      for (int c = 0; c < 3; ++c) {
        // Rounding to 8 bits is part of neither.
        const double e = std::max(0.0, std::abs(image.rgba[4 * p + c] - 255.0 * colour[3 * p + c]) - 0.5) / 255.0;
        squares += e * e;
      }
    }
  });
  d.psnr = -10 * std::log10(std::max(1e-20, squares / (3.0 * static_cast<double>(d.pixels - d.ties))));
  return d;
}

}  // namespace

TEST_CASE("the renderer shows what the kernels infer", "[renderer]") {
  auto gpu = test::open_device();
  Reference r(*gpu);
  render::Renderer renderer(*gpu);
  const render::MlpUse use = GENERATE(render::MlpUse::compiled, render::MlpUse::read);
  const render::GpuModel drawn = render::upload_model(*gpu, r.model, use);
  CHECK(drawn.opaque + drawn.masked <= drawn.triangles);
  const Difference d = compare(r, renderer, drawn, r.scene.views);
  CAPTURE(d.pixels, d.visible, d.ties, d.psnr);
  CHECK(d.visible > d.pixels / 10);
  CHECK(d.ties * 1000 <= d.pixels);
  CHECK(d.psnr > 60);
  test::require_silence(*gpu);
}
