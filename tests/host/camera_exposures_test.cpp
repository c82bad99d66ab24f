// Tests engine/train/quality/camera_exposures.h, and that model files keep exposures of cameras.
#include <catch2/catch.hpp>

#include <vector>

#include "format/model_file.h"
#include "soup/texture_table.h"
#include "train/quality/camera_exposures.h"

using namespace trisoup;

namespace {

scene::View view_of(const std::string& name, int width, int height, double focal) {
  scene::View view;
  view.name = name;
  view.camera.width = width, view.camera.height = height;
  view.camera.fx = view.camera.fy = focal;
  return view;
}

void add_exposure(std::vector<glm::vec4>& rows, const glm::vec3& gain, float offset) {
  rows.emplace_back(gain, 0.0f);
  rows.emplace_back(glm::vec3(offset), 0.0f);
}

struct TwoCameras {
  std::vector<scene::View> views;
  std::vector<glm::vec4> exposures;
};

/// Eight bright photographs in `a` and four dark ones in `b`.
TwoCameras two_cameras(float spread) {
  TwoCameras two;
  for (int i = 0; i < 12; ++i) {
    const bool dark = i >= 8;
    two.views.push_back(view_of(dark ? "images/b/" + std::to_string(i) : "images/a/" + std::to_string(i), 60, 40, 50));
    const float beyond = i % 2 == 0 ? spread : -spread;
    add_exposure(two.exposures, glm::vec3(dark ? 0.5f : 1.25f) + beyond, dark ? -0.02f : 0.01f);
  }
  return two;
}

}  // namespace

TEST_CASE("test views have the mean exposure of the training photographs of their camera", "[exposure]") {
  const TwoCameras two = two_cameras(0);
  const auto cameras = train::camera_exposures(two.views, two.exposures);
  REQUIRE(cameras.size() == 2);
  const auto* const bright = train::exposure_of(view_of("images/a/test.jpg", 60, 40, 50), cameras);
  const auto* const dark = train::exposure_of(view_of("images/b/test.jpg", 60, 40, 52), cameras);
  REQUIRE((bright && dark));
  CHECK(bright->gain.r == Approx(1.25f));
  CHECK(dark->gain.g == Approx(0.5f));
  CHECK(dark->offset.b == Approx(-0.02f));
  // The same camera in the other orientation, or in smaller photographs.
  CHECK(train::exposure_of(view_of("images/b/portrait.jpg", 40, 60, 50), cameras) == dark);
  CHECK(train::exposure_of(view_of("images/b/small.jpg", 30, 20, 25), cameras) == dark);
  CHECK_FALSE(train::exposure_of(view_of("images/c/other.jpg", 60, 40, 50), cameras));
  CHECK_FALSE(train::exposure_of(view_of("images/b/zoomed.jpg", 60, 40, 80), cameras));
  CHECK_FALSE(train::exposure_of(view_of("images/b/square.jpg", 60, 60, 50), cameras));
}

TEST_CASE("cameras in one folder are told apart by their angle of view", "[exposure]") {
  TwoCameras two = two_cameras(0);
  for (std::size_t i = 0; i < two.views.size(); ++i)
    two.views[i] = view_of("images/" + std::to_string(i), 60, 40, i >= 8 ? 25 : 50);
  CHECK(train::camera_exposures(two.views, two.exposures).size() == 2);
}

TEST_CASE("one camera has no exposure of its own", "[exposure]") {
  TwoCameras two = two_cameras(0.1f);
  for (scene::View& view : two.views) view.name = "images/a/x.jpg";
  CHECK(train::camera_exposures(two.views, two.exposures).empty());
  CHECK(train::camera_exposures(two_cameras(0).views, {}).empty());
}

TEST_CASE("exposures of cameras shrink if photographs of one camera differ as much", "[exposure]") {
  const TwoCameras two = two_cameras(0.6f);
  const auto cameras = train::camera_exposures(two.views, two.exposures);
  REQUIRE(cameras.size() == 2);
  CHECK(cameras[0].gain.r < 1.1f);
  CHECK(cameras[1].gain.r > 0.6f);
  CHECK(cameras[1].gain.r < 0.9f);
}

TEST_CASE("an exposure changes all of a picture but its background", "[exposure]") {
  std::vector<float> colour{0, 0, 0, 0.5f, 0.25f, 1};
  soup::CameraExposure e;
  e.gain = glm::vec3(0.5f, 2, 2), e.offset = glm::vec3(0.1f, 0, 0);
  train::expose(colour, e, glm::vec3(0));
  CHECK(colour == std::vector<float>{0, 0, 0, 0.35f, 0.5f, 1});
}

TEST_CASE("a model file keeps the exposures of cameras", "[exposure][model]") {
  soup::Model model;
  model.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  model.textures = soup::make_texture_table(1, soup::TextureLevels{0, 0}).entries;
  model.lattice.assign(std::size_t(soup::samples_at(0)) * soup::kChannels, 7);
  const auto read_back = [&] { return soup::decode_model(soup::encode_model(model, {}), "model").model.exposures; };
  CHECK(read_back().empty());
  model.exposures = train::camera_exposures(two_cameras(0).views, two_cameras(0).exposures);
  const auto again = read_back();
  REQUIRE(again.size() == 2);
  CHECK(again[1].folder == "images/b");
  CHECK(again[1].focal == model.exposures[1].focal);
  CHECK(again[1].aspect == model.exposures[1].aspect);
  CHECK(again[1].gain == model.exposures[1].gain);
  CHECK(again[1].offset == model.exposures[1].offset);
}
