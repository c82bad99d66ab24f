// Tests engine/train/quality/covisibility.h (view_depths.comp, covisible.comp) and the co-visible metrics of
// evaluate.h, with a wall and a pillar in front of it, whose co-visible columns of pixels can be counted by hand.
#include <catch2/catch.hpp>

#include <cmath>
#include <string>

#include <nlohmann/json.hpp>

#include "gpu/small_scene.h"
#include "train/quality/covisibility.h"
#include "train/quality/evaluate.h"

using namespace trisoup;

namespace {

constexpr int kWallViewSide = 64;
constexpr float kWallShift = 0.3f / 32;  // a third of a pixel at the wall, so that no column lies on a border

/// Looks along +z from (x, 0, 0). A pixel covers 1/32 of the wall and 1/64 of the pillar.
scene::View wall_view(double x) {
  scene::Camera camera;
  camera.width = camera.height = kWallViewSide;
  camera.fx = camera.fy = 64;
  camera.cx = camera.cy = 32;
  camera.world_to_camera[3] = glm::dvec4(-x, 0, 0, 1);
  return {"view at " + std::to_string(x),
          camera,
          {kWallViewSide, kWallViewSide, std::vector<std::uint8_t>(4 * kWallViewSide * kWallViewSide, 255)}};
}

/// Opaque rectangles in planes of constant z, over all rows of a view.
soup::Model model_of_walls(const std::vector<glm::vec3>& rectangles) {  // x from, x to, z
  soup::Model model;
  for (const glm::vec3& r : rectangles)
    for (const glm::vec2 corner : {glm::vec2(r.x, -9), {r.y, -9}, {r.x, 9}, {r.x, 9}, {r.y, -9}, {r.y, 9}})
      model.vertices.emplace_back(corner, r.z);
  model.textures = soup::make_texture_table(2 * rectangles.size(), soup::TextureLevels{0, 0}).entries;
  model.lattice.assign(model.textures.size() * soup::samples_at(0) * soup::kChannels, 255);
  model.mlp = train::initial_mlp(1);
  return model;
}

const glm::vec3 kWall(-9, 9, 2), kPillar(0.25f, 0.5f, 1);

struct MeasuredColumns {
  train::Evaluation evaluation;
  std::string columns;  // of the mask: '#' where all rows are co-visible, '.' where none is, else '?'
};

MeasuredColumns measure_columns(gpu::Device& gpu, const soup::Model& model, const std::vector<scene::View>& train) {
  scene::Scene scene;
  scene.train = train;
  scene.test = {wall_view(0)};
  MeasuredColumns measured;
  measured.evaluation = train::evaluate(gpu, model, scene, 0.025, 10, {}, nullptr,
                                        [&](const scene::View&, const std::vector<std::uint8_t>& mask) {
                                          REQUIRE(mask.size() == std::size_t(kWallViewSide * kWallViewSide));
                                          for (int x = 0; x < kWallViewSide; ++x) {
                                            int rows = 0;
                                            for (int y = 0; y < kWallViewSide; ++y)
                                              rows += mask[std::size_t(y * kWallViewSide + x)] == 255;
                                            measured.columns += rows == kWallViewSide ? '#' : rows == 0 ? '.' : '?';
                                          }
                                        });
  test::require_silence(gpu);
  return measured;
}

std::string columns_at(std::initializer_list<std::pair<int, int>> ranges) {
  std::string text(kWallViewSide, '.');
  for (const auto& [first, last] : ranges)
    text.replace(std::size_t(first), std::size_t(last - first), std::size_t(last - first), '#');
  return text;
}

}  // namespace

TEST_CASE("pixels that one of two training views cannot see are not co-visible", "[covisible][each_driver]") {
  auto gpu = test::open_device();
  // The test view shows the wall in columns 0 to 47 and the pillar in 48 to 63. The second training view sees 16
  // columns further to the right, and the pillar in its columns 15 to 30 hides what the test view shows in columns 32
  // to 46.
  const MeasuredColumns both =
      measure_columns(*gpu, model_of_walls({kWall, kPillar}), {wall_view(kWallShift), wall_view(0.5 + kWallShift)});
  CHECK(both.columns == columns_at({{16, 32}, {47, 64}}));
  REQUIRE(both.evaluation.covisible);
  CHECK(both.evaluation.covisible->share == 33.0 / 64);
  CHECK(both.evaluation.views[0].covisible->metrics.pixels == 33 * kWallViewSide);
  // Without the pillar only the border of the second view limits it.
  CHECK(measure_columns(*gpu, model_of_walls({kWall}), {wall_view(kWallShift), wall_view(0.5 + kWallShift)}).columns ==
        columns_at({{16, 64}}));
  // Two witnesses are enough, whatever others hide.
  CHECK(measure_columns(*gpu, model_of_walls({kWall, kPillar}),
                        {wall_view(kWallShift), wall_view(0.5 + kWallShift), wall_view(-kWallShift)})
            .columns == columns_at({{0, 64}}));
}

TEST_CASE("what a training view masks out is not seen by it", "[covisible]") {
  auto gpu = test::open_device();
  std::vector<scene::View> train{wall_view(kWallShift), wall_view(0.5 + kWallShift)};
  for (std::size_t p = 0; p < std::size_t(kWallViewSide * kWallViewSide); ++p)
    if (p % kWallViewSide < 32) train[0].image.rgba[4 * p + 3] = 0;
  CHECK(measure_columns(*gpu, model_of_walls({kWall, kPillar}), train).columns == columns_at({{47, 64}}));
  // soup-eval does not read the photographs of datasets without masks.
  train[0].image = {};
  CHECK(measure_columns(*gpu, model_of_walls({kWall, kPillar}), train).columns == columns_at({{16, 32}, {47, 64}}));
}

TEST_CASE("pixels without triangles are points at infinity", "[covisible]") {
  auto gpu = test::open_device();
  // Every view has the same direction in the same column. Columns that border on a pillar may belong to it.
  const std::string seen =
      measure_columns(*gpu, model_of_walls({kPillar}), {wall_view(kWallShift), wall_view(0.5 + kWallShift)}).columns;
  CHECK(seen.substr(0, 14) == std::string(14, '#'));
  CHECK(seen.substr(17, 12) == std::string(12, '.'));
  CHECK(seen.substr(32, 14) == std::string(14, '#'));
  CHECK(seen.substr(48) == std::string(16, '#'));
}

TEST_CASE("metrics over co-visible pixels", "[covisible]") {
  auto gpu = test::open_device();
  SECTION("are the usual ones if all pixels are co-visible") {
    const train::Evaluation e =
        measure_columns(*gpu, model_of_walls({kWall, kPillar}), {wall_view(0), wall_view(0)}).evaluation;
    CHECK(e.views[0].covisible->share == 1);
    CHECK(e.covisible->psnr == e.mean.psnr);
    CHECK(e.covisible->ssim == e.mean.ssim);
    CHECK(e.covisible->left_out == 0);
  }
  SECTION("are those of the pixels inside the mask otherwise") {
    const train::Evaluation e =
        measure_columns(*gpu, model_of_walls({kWall, kPillar}), {wall_view(kWallShift), wall_view(0.5 + kWallShift)})
            .evaluation;
    // White photographs, and one colour on the wall and the pillar: differences come from the view direction only.
    CHECK(e.covisible->psnr == Approx(e.mean.psnr).margin(3));
    CHECK(e.covisible->psnr != e.mean.psnr);
    CHECK(e.covisible->ssim != e.mean.ssim);
  }
  SECTION("are absent if the training views are not known") {
    const train::Evaluation e = measure_columns(*gpu, model_of_walls({kWall}), {wall_view(0)}).evaluation;
    CHECK_FALSE(e.covisible);
    CHECK_FALSE(to_json(e).contains("psnr_covisible"));
  }
  SECTION("leave out views with too few co-visible pixels") {
    // Three units to the side, where the wall that the test view shows is out of the picture.
    const train::Evaluation e = measure_columns(*gpu, model_of_walls({kWall}), {wall_view(3), wall_view(4)}).evaluation;
    CHECK(e.covisible->share == 0);
    CHECK(e.covisible->left_out == 1);
    const nlohmann::json json = to_json(e);
    CHECK(json["psnr_covisible"].is_null());
    CHECK(json["views"][0]["psnr_covisible"].is_null());
    CHECK(json["covisible"] == 0);
    CHECK(json["views_hardly_covisible"] == 1);
    CHECK(json["psnr"].is_number());
  }
}

TEST_CASE("more training views than depth images in memory give the same masks", "[covisible]") {
  // Each test view has its training views beside it: two views, then far away others.
  std::vector<scene::View> train, tests;
  for (int i = 0; i < 6; ++i) {
    tests.push_back(wall_view(10.0 * i));
    for (int k = 0; k < 60; ++k) train.push_back(wall_view(10.0 * i + (k % 2 == 0 ? kWallShift : 0.5 + kWallShift)));
  }
  auto gpu = test::open_device();
  scene::Scene scene;
  scene.train = train;
  scene.test = tests;
  const train::Evaluation e = train::evaluate(*gpu, model_of_walls({{-9, 99, 2}}), scene, 0.025, 10);
  REQUIRE(e.views.size() == 6);
  for (const train::ViewMetrics& view : e.views) {
    CAPTURE(view.name);
    CHECK(view.covisible->share == 1);
  }
  CHECK(train.size() > train::Covisibility::kMostDepths);
}

TEST_CASE("the nearest training views come first", "[covisible]") {
  std::vector<scene::View> train{wall_view(3), wall_view(-0.1), wall_view(0.5)};
  CHECK(train::nearest_views(wall_view(0).camera, train, 9) == std::vector<std::uint32_t>{1, 2, 0});
  CHECK(train::nearest_views(wall_view(2).camera, train, 2) == std::vector<std::uint32_t>{0, 2});
  // One that looks the other way is of no use.
  train[1].camera.world_to_camera =
      glm::dmat4(glm::dvec4(-1, 0, 0, 0), glm::dvec4(0, 1, 0, 0), glm::dvec4(0, 0, -1, 0), glm::dvec4(0, 0, 0, 1));
  CHECK(train::nearest_views(wall_view(0).camera, train, 1) == std::vector<std::uint32_t>{2});
}
