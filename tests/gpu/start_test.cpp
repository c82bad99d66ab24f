// Tests engine/train/paint.h and engine/train/plugs.h on a device: what a start shows before the first step, and that what it covers stays covered.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>

#include "gpu/small_scene.h"
#include "train/plugs.h"
#include "train/trainer.h"

using namespace trisoup;
using test::SmallScene;

namespace {

/// From x = 1 towards the origin. Smooth colours; a square of it, of another colour, is masked out.
scene::View smooth_view() {
  constexpr int kSide = 64;
  scene::View v;
  v.name = "smooth";
  v.camera.width = v.camera.height = kSide;
  v.camera.fx = v.camera.fy = 1.25 * kSide;
  v.camera.cx = v.camera.cy = 0.5 * kSide;
  v.camera.world_to_camera = glm::inverse(glm::dmat4(glm::dvec4(0, 1, 0, 0), glm::dvec4(0, 0, -1, 0), glm::dvec4(-1, 0, 0, 0), glm::dvec4(1, 0, 0, 1)));
  v.image = {kSide, kSide, {}};
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) {
      const double colour[3] = {0.2 + 0.6 * x / kSide, 0.5 + 0.3 * std::sin(0.2 * y), 0.5 + 0.3 * std::cos(0.15 * (x + y))};
      const bool masked = std::abs(x - 40) < 8 && std::abs(y - 20) < 8;
      for (const double c : colour) v.image.rgba.push_back(masked ? 255 : static_cast<std::uint8_t>(std::lround(255 * c)));
      v.image.rgba.push_back(masked ? 0 : 255);
    }
  return v;
}

}  // namespace

TEST_CASE("a painted start shows the photographs before the first step", "[start]") {
  auto gpu = test::open_device();
  scene::Scene scene;
  scene.train = scene.test = {smooth_view()};
  train::Settings settings = train::published(train::Recipe::real);
  settings.triangles = settings.init_count = 2;
  settings.near = settings.test_near = 0.025;
  settings.far = 10;
  settings.init_opacity = 0.9;
  settings.coarse_share = 0;
  settings.level_min = GENERATE(0u, 2u);
  settings.level_max = 4;
  settings.samples_per_pixel = GENERATE(0.0, 1.0);
  constexpr float h = 0.42f;  // fills the picture
  train::Start square(std::vector<glm::vec3>{{0, -h, -h}, {0, h, -h}, {0, h, h}, {0, -h, -h}, {0, h, h}, {0, -h, h}});
  square.colours.assign(6, glm::vec3(0.3f, 0.4f, 0.6f));
  const auto psnr = [&](bool paint) {
    settings.paint = paint;
    train::Trainer trainer(*gpu, scene, settings, square);
    float white = 0;
    const double psnr = trainer.evaluate_float([&](const scene::View&, const std::vector<float>& colour) { white = colour[3 * (20 * 64 + 40)]; }).mean.psnr;
    CHECK(white < 0.8f);  // what is masked out says nothing
    return psnr;
  };
  CHECK(psnr(false) < 18);
  CHECK(psnr(true) > 29);
  test::require_silence(*gpu);
}

TEST_CASE("what would open a hole stays", "[start][each_driver]") {
  auto gpu = test::open_device();
  // From the camera at x = 1: a triangle, one behind it, a backdrop.
  SmallScene s(*gpu, 3, {{0, 0}}, {test::view_from(0, 16, 16), test::view_from(0.2, 9, 13)});
  std::vector<glm::vec3> vertices;
  for (const float x : {0.2f, 0.0f, -0.5f}) vertices.insert(vertices.end(), {{x, -9, -9}, {x, 9, -9}, {x, 0, 18}});
  gpu->upload(s.soup.vertices.address(), vertices);
  for (std::size_t i = 7; i < s.logits.size(); i += 8) s.logits[i] = 30;
  gpu->upload(s.soup.source.address(), s.logits);
  s.step.sum_textures();
  const auto before = gpu->download_vector<float>(s.soup.opacity.address(), s.soup.lattice_samples);
  const auto plugged = [&](std::vector<std::uint32_t> kept, std::vector<bool> backdrop, std::size_t most) {
    train::add_plugs(*gpu, s.soup, s.frame, s.views, backdrop, most, kept);
    return kept;
  };
  using List = std::vector<std::uint32_t>;
  CHECK(plugged({1, 2}, {false, false, true}, 3) == List{1, 2});     // what is behind it does
  CHECK(plugged({2}, {false, false, true}, 3) == List{0, 2});        // without both the backdrop would show; the second was never seen
  CHECK(plugged({2}, {false, false, false}, 3) == List{2});          // no backdrop, a triangle like others
  CHECK(plugged({1}, {false, false, true}, 3) == List{1});           // a backdrop behind it is missed by nobody
  CHECK(plugged({}, {false, false, false}, 3) == List{0});           // or nothing at all would show
  CHECK(plugged({2}, {false, false, true}, 1) == List{2});           // no room
  CHECK(gpu->download_vector<float>(s.soup.opacity.address(), s.soup.lattice_samples) == before);
  test::require_silence(*gpu);
}
