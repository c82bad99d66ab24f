// Tests engine/render/shading.h: shading by a kernel matches shading in fragment shaders, and the choice between both.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "environment_variable.h"
#include "gpu/small_scene.h"
#include "render/cameras.h"
#include "render/renderer.h"
#include "temporary_folder.h"
#include "train/quality/evaluate_renderer.h"

using namespace trisoup;
using render::Shading;

namespace {

soup::Model soup_of(gpu::Device& gpu, std::uint32_t triangles) {
  const std::vector<soup::TextureLevels> levels{{0, 0}, {2, 5}, {1, 3}, {5, 5}, {0, 1}, {2, 4}};
  test::SmallScene scene(gpu, triangles, levels, {test::view_from(0, 16, 16)});
  return train::make_model(gpu, scene.soup, glm::vec3(1.0f, 0.5f, 0.25f), {});
}

render::View camera_at(double angle, int width, int height) {
  const glm::dvec3 eye(std::cos(angle), std::sin(angle), 0.2);
  return render::view_of(render::look_at(eye, {0, 0, 0}, {0, 0, 1}, 0.9, width, height), 0.025, 2.5);
}

/// Large enough for the measurement that chooses how to shade.
const render::View kLarge = camera_at(0.3, 1280, 720);

/// Draws an image with a new renderer, and returns how it was shaded.
Shading shaded(gpu::Device& gpu, const render::GpuModel& model, const render::View& view,
               Shading asked = render::asked_shading()) {
  render::Renderer renderer(gpu, asked);
  renderer.picture(model, view, {});
  return renderer.shading();
}

/// The files that store the chosen way to shade.
std::vector<std::filesystem::path> choices_in(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator(folder, none))
    if (entry.path().extension().string().starts_with(".shade")) files.push_back(entry.path());
  return files;
}

/// Largest difference of two images of the same size, in levels of 255.
int difference(const Image& a, const Image& b) {
  REQUIRE(a.rgba.size() == b.rgba.size());
  int worst = 0;
  for (std::size_t i = 0; i < a.rgba.size(); ++i) worst = std::max(worst, std::abs(a.rgba[i] - b.rgba[i]));
  return worst;
}

/// Largest allowed difference. Drivers for CPUs compute the same in both kinds of shader. A GPU driver may contract
/// other products and sums in a kernel, which can change the rounding of a colour.
int tolerance(const gpu::Device& gpu) { return gpu.info().kind == gpu::Kind::cpu ? 0 : 1; }

bool is_choice(const std::string& content) { return content == "fragment\n" || content == "compute\n"; }

}  // namespace

TEST_CASE("shading by a kernel matches shading in fragment shaders", "[renderer][shading][each_driver]") {
  auto gpu = test::open_device();
  const soup::Model model = soup_of(*gpu, 40);
  const auto use = GENERATE(render::MlpUse::compiled, render::MlpUse::read);
  const render::GpuModel drawn = render::upload_model(*gpu, model, use);
  render::Renderer fragments(*gpu, Shading::fragment), kernel(*gpu, Shading::compute);
  render::DrawOptions options;
  options.background = glm::vec3(0.2f, 0.501f, 0.9999f);
  std::size_t shown = 0, background = 0;
  for (const auto& view : {camera_at(0.3, 161, 97), camera_at(2.0, 64, 64), camera_at(4.0, 7, 3),
                           camera_at(1.0, 203, 8), camera_at(5.0, 1, 130)}) {
    const Image expected = fragments.picture(drawn, view, options), found = kernel.picture(drawn, view, options);
    CAPTURE(view.width, view.height);
    CHECK(fragments.shading() == Shading::fragment);
    CHECK(kernel.shading() == Shading::compute);
    CHECK(difference(found, expected) <= tolerance(*gpu));
    for (const std::uint32_t hit : kernel.hits()) ++(hit == 0 ? background : shown);
  }
  CHECK(shown > 2000);
  CHECK(background > 2000);
  test::require_silence(*gpu);
}

TEST_CASE("shading by a kernel matches fragment shaders in every mode", "[renderer][shading]") {
  auto gpu = test::open_device();
  const soup::Model model = soup_of(*gpu, 20);
  const render::GpuModel drawn = render::upload_model(*gpu, model, render::MlpUse::read);
  render::Renderer fragments(*gpu, Shading::fragment), kernel(*gpu, Shading::compute);
  for (std::uint32_t mode = 0; mode < render::kModes; ++mode) {
    render::DrawOptions options;
    options.mode = static_cast<render::Mode>(mode);
    options.channel = 4;
    const render::View view = camera_at(0.5, 83, 61);
    CAPTURE(mode);
    CHECK(difference(kernel.picture(drawn, view, options), fragments.picture(drawn, view, options)) <= tolerance(*gpu));
  }
  test::require_silence(*gpu);
}

TEST_CASE("anti-aliased images are shaded in fragment shaders", "[renderer][shading]") {
  auto gpu = test::open_device();
  const render::GpuModel drawn = render::upload_model(*gpu, soup_of(*gpu, 20), render::MlpUse::read);
  render::Renderer renderer(*gpu, Shading::compute), fragments(*gpu, Shading::fragment);
  const render::View view = camera_at(0.5, 83, 61);
  for (const auto aa : {render::AntiAliasing::msaa, render::AntiAliasing::none, render::AntiAliasing::ssaa}) {
    render::DrawOptions options;
    options.aa = aa;
    const Image expected = fragments.picture(drawn, view, options);
    CHECK(difference(renderer.picture(drawn, view, options), expected) <= tolerance(*gpu));
    CHECK((renderer.shading() == Shading::compute) == (aa == render::AntiAliasing::none));
  }
  test::require_silence(*gpu);
}

TEST_CASE("consecutive images without waiting do not affect each other", "[renderer][shading]") {
  auto gpu = test::open_device();
  gpu::Graphics& graphics = gpu::graphics_of(*gpu);
  const render::GpuModel drawn = render::upload_model(*gpu, soup_of(*gpu, 40), render::MlpUse::read);
  render::Renderer kernel(*gpu, Shading::compute), fragments(*gpu, Shading::fragment);
  std::vector<gpu::Image> pictures;
  std::vector<Image> expected;
  for (int i = 0; i < 4; ++i) expected.push_back(kernel.picture(drawn, camera_at(i, 150, 90), {}));
  // Both images write one target, and share a frame that is overwritten as soon as a kernel has read it.
  const gpu::Image target = graphics.create_image({gpu::Format::rgba8, 150, 90}, "picture");
  for (int i = 0; i < 4; ++i) {
    pictures.push_back(graphics.create_image({gpu::Format::rgba8, 150, 90}, "picture"));
    kernel.draw(drawn, camera_at(i, 150, 90), {}, pictures.back());
    fragments.draw(drawn, camera_at(i + 1, 150, 90), {}, target);
    kernel.draw(drawn, camera_at(i + 2, 150, 90), {}, target);
    kernel.draw(drawn, camera_at(i, 150, 90), {}, target);
    graphics.copy(target, pictures.back());
  }
  for (std::size_t i = 0; i < 4; ++i) CHECK(difference(render::download(graphics, pictures[i]), expected[i]) == 0);
  test::require_silence(*gpu);
}

TEST_CASE("the faster way to shade is measured once with a large image and stored in a file", "[renderer][shading]") {
  auto gpu = test::open_own_device();
  const test::TemporaryFolder folder;
  const test::Variable cache("XDG_CACHE_HOME", folder.path().c_str()), asked("TRISOUP_SHADING", nullptr);
  const std::filesystem::path kept = folder / "trisoup";
  const soup::Model model = soup_of(*gpu, render::kLeastTriangles), small = soup_of(*gpu, render::kLeastTriangles - 1);
  // Small images, small models and an explicit choice of the caller cause no measurement.
  gpu = test::open_own_device();
  {
    const render::GpuModel drawn = render::upload_model(*gpu, model), few = render::upload_model(*gpu, small);
    CHECK(shaded(*gpu, drawn, camera_at(0.3, 640, 360)) == Shading::fragment);
    CHECK(shaded(*gpu, few, kLarge) == Shading::fragment);
    CHECK(shaded(*gpu, drawn, kLarge, Shading::compute) == Shading::compute);
    // Other modes have other shaders, and only a renderer's first image may wait for a measurement.
    render::Renderer renderer(*gpu);
    render::DrawOptions options;
    options.mode = render::Mode::normals;
    renderer.picture(drawn, kLarge, options);
    renderer.picture(drawn, kLarge, {});
    CHECK(renderer.shading() == Shading::fragment);
    CHECK(choices_in(kept).empty());
    const Shading measured = shaded(*gpu, drawn, kLarge);
    const auto files = choices_in(kept);
    REQUIRE(files.size() == 1);
    CHECK(files[0].extension() == ".shade_fixed");
    CHECK(test::content_of(files[0]) == std::string(render::to_string(measured)) + "\n");
  }
  test::require_silence(*gpu);
  // The stored choice applies to images and models of any size.
  const auto file = choices_in(kept).at(0);
  for (const Shading said : {Shading::compute, Shading::fragment}) {
    std::ofstream(file, std::ios::binary) << render::to_string(said) << '\n';
    gpu = test::open_own_device();
    CHECK(shaded(*gpu, render::upload_model(*gpu, small), camera_at(0.3, 64, 36)) == said);
    test::require_silence(*gpu);
  }
  // A damaged file is ignored, and replaced by the next measurement.
  for (const std::string& damaged : {std::string("comput\n"), std::string("auto\n"), std::string(100, '\n')}) {
    std::ofstream(file, std::ios::binary) << damaged;
    gpu = test::open_own_device();
    CAPTURE(damaged);
    const render::GpuModel drawn = render::upload_model(*gpu, model);
    CHECK(shaded(*gpu, drawn, camera_at(0.3, 64, 36)) == Shading::fragment);
    CHECK(test::content_of(file) == damaged);
    shaded(*gpu, drawn, kLarge);
    CHECK(is_choice(test::content_of(file)));
  }
  test::require_silence(*gpu);
}

TEST_CASE("without a writable file, shading is measured once per device", "[renderer][shading]") {
  auto gpu = test::open_own_device();
  const test::TemporaryFolder folder;
  const test::Variable cache("XDG_CACHE_HOME", folder.path().c_str()), asked("TRISOUP_SHADING", nullptr);
  const soup::Model model = soup_of(*gpu, render::kLeastTriangles);
  folder.file("trisoup", "a file");
  gpu = test::open_own_device();
  const render::GpuModel drawn = render::upload_model(*gpu, model);
  const Shading first = shaded(*gpu, drawn, kLarge);
  CHECK(gpu::graphics_of(*gpu).recall("shade_fixed") == render::to_string(first));
  // The choice also applies to an image that is too small for a measurement.
  CHECK(shaded(*gpu, drawn, camera_at(0.3, 64, 36)) == first);
  CHECK(test::content_of(folder / "trisoup") == "a file");
  test::require_silence(*gpu);
}

TEST_CASE("TRISOUP_SHADING sets the choice and accepts three words", "[renderer][shading]") {
  auto gpu = test::open_own_device();
  const render::GpuModel drawn = render::upload_model(*gpu, soup_of(*gpu, 5), render::MlpUse::read);
  test::Variable asked("TRISOUP_SHADING", "compute");
  CHECK(shaded(*gpu, drawn, camera_at(0.3, 64, 36)) == Shading::compute);
  asked.set("fragment");
  CHECK(shaded(*gpu, drawn, camera_at(0.3, 64, 36)) == Shading::fragment);
  asked.set("auto");
  CHECK(render::asked_shading() == Shading::automatic);
  asked.set("kernel");
  CHECK_THROWS_WITH(render::Renderer(*gpu),
                    Catch::Equals("TRISOUP_SHADING=kernel: unknown value; use auto, fragment or compute"));
}
