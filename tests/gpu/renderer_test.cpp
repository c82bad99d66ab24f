// Tests engine/render/renderer.h against the training kernels.
#include <catch2/catch.hpp>

#include <numeric>

#include "gpu/small_scene.h"
#include "render/cameras.h"
#include "render/renderer.h"
#include "train/quality/evaluate_renderer.h"
#include "viewer/kernel_renderer.h"

using namespace trisoup;

namespace {

scene::View view_at(double angle, int width, int height) {
  scene::View view;
  view.name = "view";
  view.camera = render::look_at({std::cos(angle), std::sin(angle), 0.2}, {0, 0, 0}, {0, 0, 1}, 0.8, width, height);
  return view;
}

/// A random soup with all texture levels.
soup::Model random_model(gpu::Device& gpu, std::uint32_t triangles) {
  test::SmallScene scene(gpu, triangles, {{0, 0}, {2, 5}, {1, 3}, {5, 5}, {0, 1}, {2, 4}},
                         {test::view_from(0, 16, 16)});
  return train::make_model(gpu, scene.soup, glm::vec3(1.0f, 0.5f, 0.25f), {});
}

double mean_of(const Image& image) {
  return std::accumulate(image.rgba.begin(), image.rgba.end(), 0.0) / static_cast<double>(image.rgba.size());
}

}  // namespace

TEST_CASE("the renderer matches inference by the kernels", "[renderer][each_driver]") {
  auto gpu = test::open_device();
  const soup::Model model = random_model(*gpu, 40);
  const render::MlpUse use = GENERATE(render::MlpUse::compiled, render::MlpUse::read);
  for (const train::RendererComparison& a :
       train::compare_renderer(*gpu, model, {view_at(0.3, 200, 144), view_at(2.0, 160, 160)}, {}, 0.025, 2.5, use)) {
    CAPTURE(a.pixels, a.ties, a.psnr);
    CHECK(a.ties * 1000 <= a.pixels);
    CHECK(a.psnr > 60);
  }
  test::require_silence(*gpu);
}

TEST_CASE("the window's pictures by kernels are those of the renderer", "[renderer]") {
  auto gpu = test::open_device();
  soup::Model model = random_model(*gpu, 40);
  // A model is shown in normalised coordinates, and a training replaces it.
  model.centre = {0.1, 0.0, 0.05};
  model.scale = 0.9;
  viewer::KernelRenderer kernels;
  kernels.load(random_model(*gpu, 12));
  kernels.load(model);
  render::Renderer renderer(*gpu);
  const render::GpuModel drawn = render::upload_model(*gpu, model);
  render::DrawOptions options;
  options.background = {0.25f, 0.5f, 0.75f};
  for (const auto& [width, height] : {std::pair(200, 144), {90, 61}}) {
    const render::View view = render::view_of(view_at(0.3, width, height).camera, 0.025, 2.5);
    const Image ours = kernels.draw(view, options), other = renderer.picture(drawn, view, options);
    REQUIRE(ours.width == width);
    REQUIRE(ours.height == height);
    REQUIRE(ours.rgba.size() == other.rgba.size());
    std::size_t differ = 0, soup = 0;
    for (std::size_t i = 0; i < ours.rgba.size(); i += 4) {
      int most = 0;
      for (std::size_t c = 0; c < 4; ++c) most = std::max(most, std::abs(ours.rgba[i + c] - other.rgba[i + c]));
      differ += most > 1;
      soup += ours.rgba[i] != 64;
    }
    CHECK(differ <= train::max_ties(ours.rgba.size() / 4));
    CHECK(soup > ours.rgba.size() / 40);
  }
  CHECK(viewer::KernelRenderer::draws({}));
  CHECK(!viewer::KernelRenderer::draws({.mode = render::Mode::depth}));
  CHECK(!viewer::KernelRenderer::draws({.aa = render::AntiAliasing::ssaa}));
}

TEST_CASE("opaque, masked and invisible triangles are distinguished", "[renderer]") {
  auto gpu = test::open_device();
  soup::Model model = random_model(*gpu, 12);
  for (std::size_t t = 0; t < 12; ++t)
    for (std::uint32_t i = 0; i < soup::samples_at(model.textures[t].level_max); ++i) {
      // 128 / 255 is just above the threshold, 127 / 255 just below.
      std::uint8_t& opacity = model.lattice[(model.textures[t].lattice_offset + i) * 8 + 7];
      opacity = t < 4 ? 128 : t < 8 ? 127 : i == 0 ? 128 : 0;
    }
  const render::GpuModel drawn = render::upload_model(*gpu, model);
  CHECK(drawn.opaque == 4);
  CHECK(drawn.masked == 4);
  for (const train::RendererComparison& a :
       train::compare_renderer(*gpu, model, {view_at(1.0, 128, 96)}, {}, 0.025, 2.5)) {
    CHECK(a.ties * 1000 <= a.pixels);
    CHECK(a.psnr > 60);
  }
}

TEST_CASE("anti-aliasing approximates a supersampled image", "[renderer]") {
  auto gpu = test::open_device();
  const soup::Model model = random_model(*gpu, 40);
  const render::GpuModel drawn = render::upload_model(*gpu, model);
  render::Renderer renderer(*gpu);
  const auto picture = [&](int scale, render::AntiAliasing aa) {
    render::DrawOptions options;
    options.aa = aa;
    return renderer.picture(drawn, render::view_of(view_at(0.3, 96 * scale, 64 * scale).camera, 0.025, 2.5), options);
  };
  // The reference is an image of eight times the size after a box filter.
  const Image fine = picture(8, render::AntiAliasing::none);
  const auto error = [&](render::AntiAliasing aa) {
    const Image image = picture(1, aa);
    double squares = 0;
    for (int y = 0; y < 64; ++y)
      for (int x = 0; x < 96; ++x)
        for (int c = 0; c < 3; ++c) {
          double sum = 0;
          for (int j = 0; j < 8; ++j)
            for (int i = 0; i < 8; ++i)
              sum += fine.rgba[((std::size_t(y) * 8 + j) * 768 + std::size_t(x) * 8 + i) * 4 + c];
          const double e = sum / 64 - image.rgba[(std::size_t(y) * 96 + x) * 4 + c];
          squares += e * e;
        }
    return squares;
  };
  const double none = error(render::AntiAliasing::none), msaa = error(render::AntiAliasing::msaa),
               ssaa = error(render::AntiAliasing::ssaa);
  CAPTURE(none, msaa, ssaa);
  // Four samples have a quarter of the variance of one, apart from effects of the sample grid and of shading.
  CHECK(msaa < 0.5 * none);
  CHECK(ssaa < 0.5 * none);
  test::require_silence(*gpu);
}

TEST_CASE("every mode draws without validation messages", "[renderer]") {
  auto gpu = test::open_device();
  const soup::Model model = random_model(*gpu, 20);
  const render::GpuModel drawn = render::upload_model(*gpu, model);
  render::Renderer renderer(*gpu);
  for (std::uint32_t mode = 0; mode < render::kModes; ++mode)
    for (const auto aa : {render::AntiAliasing::none, render::AntiAliasing::msaa, render::AntiAliasing::ssaa}) {
      render::DrawOptions options;
      options.mode = static_cast<render::Mode>(mode);
      options.aa = aa;
      const Image image = renderer.picture(drawn, render::view_of(view_at(0.5, 80, 60).camera, 0.025, 2.5), options);
      // An image with alpha only would have a mean of 64.
      CAPTURE(mode, to_string(aa));
      CHECK(mean_of(image) > 65);
    }
  CHECK(render::mode_from("normals") == render::Mode::normals);
  CHECK_FALSE(render::mode_from("sepia"));
  test::require_silence(*gpu);
}

TEST_CASE("renderer and kernels clip or drop triangles that reach behind the camera in the same way",
          "[renderer][each_driver]") {
  auto gpu = test::open_device();
  soup::Model model = random_model(*gpu, 30);
  const std::vector<scene::View> views{view_at(0.3, 160, 120), view_at(2.0, 120, 120)};
  soup::Random random(12);
  for (glm::vec3& v : model.vertices)
    v = {random.uniform(-1.6f, 1.6f), random.uniform(-1.6f, 1.6f), random.uniform(-0.8f, 0.8f)};
  std::vector<std::vector<std::uint32_t>> shown;
  for (const bool drop : {false, true}) {
    model.drop_near = drop;
    for (const train::RendererComparison& a : train::compare_renderer(*gpu, model, views, {}, 0.025, 4.0)) {
      CAPTURE(drop, a.pixels, a.ties, a.psnr);
      CHECK(a.ties * 1000 <= a.pixels);
      CHECK(a.psnr > 60);
    }
    train::SoupBuffers soup = train::load_model(*gpu, model, {});
    train::BatchBuffers buffers(*gpu);
    std::vector<train::BatchView> batch;
    for (const scene::View& view : views) batch.push_back(train::batch_view(view.camera, 0.025, 4.0));
    shown.push_back(train::count_visible(*gpu, soup, buffers, batch));
  }
  // The test needs visible triangles that cross the camera plane.
  std::size_t crossing = 0;
  for (std::size_t t = 0; t < 30; ++t) crossing += shown[0][t] > 100 && shown[1][t] < shown[0][t] / 2;
  CHECK(crossing >= 4);
  test::require_silence(*gpu);
}

TEST_CASE("triangles that reach behind the camera are clipped, or dropped as published", "[renderer]") {
  auto gpu = test::open_device();
  soup::Model model = random_model(*gpu, 1);
  // The ground is one large triangle that extends below the camera and far behind it.
  model.vertices = {{-50, -30, -0.3f}, {50, -30, -0.3f}, {0, 60, -0.3f}};
  for (std::size_t i = 7; i < model.lattice.size(); i += 8) model.lattice[i] = 255;
  const render::GpuModel drawn = render::upload_model(*gpu, model);
  render::Renderer renderer(*gpu);
  const render::View view = render::view_of(view_at(0.0, 64, 64).camera, 0.025, 2.5);
  const auto covered = [&](bool drop) {
    render::DrawOptions options;
    options.drop_behind = drop;
    renderer.picture(drawn, view, options);
    std::size_t count = 0;
    for (const std::uint32_t hit : renderer.hits()) count += hit != 0;
    return count;
  };
  CHECK(covered(true) == 0);
  CHECK(covered(false) > 64 * 64 / 4);
  test::require_silence(*gpu);
}

TEST_CASE("marked triangles are tinted where they are visible, in pictures of any size", "[renderer]") {
  auto gpu = test::open_device();
  const std::uint32_t triangles = 1100;  // more than a row of the marks
  const soup::Model model = random_model(*gpu, triangles);
  render::Renderer renderer(*gpu);
  renderer.picture(render::upload_model(*gpu, model), render::view_of(view_at(0.3, 100, 70).camera, 0.025, 2.5), {});
  const std::vector<std::uint32_t> hits = renderer.hits();
  std::vector<std::uint8_t> all(triangles);
  for (std::uint32_t t = 1; t < triangles; t += 2) all[t] = 255;
  gpu::Graphics& graphics = *gpu->graphics();
  gpu::Image marks;
  render::upload_marks(graphics, all, marks);
  for (const std::uint32_t scale : {1u, 3u}) {
    const gpu::Image target = graphics.create_image({gpu::Format::rgba8, 100 * scale, 70 * scale}, "target");
    gpu::Targets blue{.colour = {&target}};
    blue.background = glm::vec4(0, 0, 1, 1);
    graphics.draw(blue, std::span<const gpu::Draw>{});
    renderer.tint(marks, glm::vec4(1, 0, 0, 0.6f), target);
    const Image image = render::download(graphics, target);
    std::size_t wrong = 0, tinted = 0, late = 0;
    for (std::uint32_t y = 0; y < 70 * scale; ++y)
      for (std::uint32_t x = 0; x < 100 * scale; ++x) {
        const std::uint32_t hit = hits[y / scale * 100 + x / scale];
        const bool marked = hit > 0 && hit % 2 == 0;
        const std::uint8_t* pixel = &image.rgba[4 * (std::size_t(y) * 100 * scale + x)];
        wrong += pixel[0] != (marked ? 153 : 0) || pixel[1] != 0 || pixel[2] != (marked ? 102 : 255);
        tinted += marked;
        late += marked && hit > 1024;
      }
    CHECK(wrong == 0);
    CHECK(tinted > 100);
    CHECK(late > 0);
  }
  test::require_silence(*gpu);
}

TEST_CASE("a soup that is nowhere visible gives the background", "[renderer]") {
  auto gpu = test::open_device();
  soup::Model model = random_model(*gpu, 5);
  for (std::size_t i = 7; i < model.lattice.size(); i += 8) model.lattice[i] = 0;
  const render::GpuModel drawn = render::upload_model(*gpu, model);
  CHECK(drawn.opaque + drawn.masked == 0);
  render::Renderer renderer(*gpu);
  for (const auto aa : {render::AntiAliasing::none, render::AntiAliasing::msaa, render::AntiAliasing::ssaa}) {
    render::DrawOptions options;
    options.aa = aa;
    options.background = glm::vec3(1.0f, 0.0f, 1.0f);
    const Image image = renderer.picture(drawn, render::view_of(view_at(0.5, 40, 30).camera, 0.025, 2.5), options);
    CHECK(image.rgba[0] == 255);
    CHECK(image.rgba[1] == 0);
    CHECK(std::equal(image.rgba.begin() + 4, image.rgba.end(), image.rgba.begin()));
  }
  test::require_silence(*gpu);
}

TEST_CASE("image sizes beyond the device's limits throw an error", "[renderer]") {
  auto gpu = test::open_device();
  gpu::Graphics& graphics = *gpu->graphics();
  CHECK_THROWS_WITH(graphics.create_image({gpu::Format::rgba8, graphics.max_side() + 1, 1}, "the wide one"),
                    Catch::Contains("the wide one"));
  CHECK_THROWS_WITH(graphics.create_image({gpu::Format::rgba8, 0, 1}, "the empty one"),
                    Catch::Contains("the empty one"));
  CHECK_THROWS_WITH(graphics.create_image({gpu::Format::rgba8, 16, 16, 1u << 30}, "the deep one"),
                    Catch::Contains("the deep one"));
  test::require_silence(*gpu);
}

TEST_CASE("copies of the same size are exact, and larger copies interpolate", "[renderer]") {
  auto gpu = test::open_device();
  gpu::Graphics& graphics = gpu::graphics_of(*gpu);
  std::vector<std::uint8_t> source(4 * 5 * 3);
  for (std::size_t i = 0; i < source.size(); ++i) source[i] = static_cast<std::uint8_t>(i * 37 % 251);
  const gpu::Image small = graphics.create_image({gpu::Format::rgba8, 5, 3}, "small"),
                   same = graphics.create_image({gpu::Format::rgba8, 5, 3}, "same"),
                   large = graphics.create_image({gpu::Format::rgba8, 23, 12}, "large");
  graphics.upload(small, 0, std::as_bytes(std::span(source)));
  graphics.copy(small, same);
  graphics.copy(small, large);
  CHECK(render::download(graphics, same).rgba == source);
  const Image enlarged = render::download(graphics, large);
  const auto at = [&](int x, int y, int c) {
    return static_cast<double>(
        source[static_cast<std::size_t>(4 * (5 * std::clamp(y, 0, 2) + std::clamp(x, 0, 4)) + c)]);
  };
  double worst = 0;
  for (int y = 0; y < 12; ++y)
    for (int x = 0; x < 23; ++x)
      for (int c = 0; c < 4; ++c) {
        const double u = (x + 0.5) * 5 / 23 - 0.5, v = (y + 0.5) * 3 / 12 - 0.5, i = std::floor(u), j = std::floor(v);
        const int x0 = static_cast<int>(i), y0 = static_cast<int>(j);
        const double above = (1 - (u - i)) * at(x0, y0, c) + (u - i) * at(x0 + 1, y0, c);
        const double below = (1 - (u - i)) * at(x0, y0 + 1, c) + (u - i) * at(x0 + 1, y0 + 1, c);
        worst = std::max(worst, std::abs((1 - (v - j)) * above + (v - j) * below -
                                         enlarged.rgba[static_cast<std::size_t>(4 * (23 * y + x) + c)]));
      }
  CHECK(worst < 2.5);  // sample positions may be rounded to 1/256 pixel: an error of up to 1 of 255, plus rounding
  test::require_silence(*gpu);
}
