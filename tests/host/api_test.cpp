// Tests the public headers (engine/api/trisoup): camera coordinates, reading models back, errors.
#include <catch2/catch.hpp>

#include <cmath>

#include <trisoup/trisoup.h>

#include "base/read_file.h"
#include "scene/scene.h"
#include "temporary_folder.h"
#include "tiny_scene.h"

using namespace trisoup;

TEST_CASE("training, renderings and model file of the library agree", "[api]") {
  const test::TemporaryFolder folder;
  test::TinyScene tiny;
  tiny.scale = 3;
  tiny.centre = {5, -2, 1};
  test::write_tiny_scene(folder.path() / "scene", tiny);
  Device device("cpu");
  const Dataset dataset(folder.path() / "scene");
  // Cameras are in dataset coordinates, not in normalised ones.
  const scene::Scene scene = scene::load(folder.path() / "scene", {});
  REQUIRE(scene.normalisation.scale != 1);
  REQUIRE(dataset.test_views().size() == scene.test.size());
  const Camera camera = dataset.test_views().front().camera;
  const glm::dvec3 centre = scene.normalisation.to_world(scene.test.front().camera.centre());
  for (int row = 0; row < 3; ++row) {
    double seen = camera.world_to_camera[4 * row + 3];
    for (int column = 0; column < 3; ++column) seen += camera.world_to_camera[4 * row + column] * centre[column];
    CHECK(std::abs(seen) < 1e-9);
  }

  Training training(device, dataset, {.preset = "fast", .steps = 20, .triangles = 60, .set = {"refine_every=10"}});
  int calls = 0;
  training.run([&](const TrainingProgress& p) { return ++calls, p.step < 10; }, 5);
  CHECK((calls == 2 && !training.finished()));
  training.run();
  REQUIRE(training.finished());
  const Model model = training.model();
  model.write(folder.path() / "model.glb");
  const Model again = Model::read(folder.path() / "model.glb");
  CHECK((again.triangles() == model.triangles() && again.bytes() == model.bytes()));
  const Picture picture = model.render(device, camera);
  REQUIRE(picture.rgb.size() == 3u * camera.width * camera.height);
  CHECK(again.render(device, camera).rgb == picture.rgb);
  CHECK(again.quality(device, dataset).psnr == model.quality(device, dataset).psnr);
  // The renderings belong to the views: their error is the one that quality() reports.
  double mae = 0;
  const std::vector<View> views = dataset.test_views();
  for (std::size_t i = 0; i < views.size(); ++i) {
    const std::vector<float> rgb = model.render(device, views[i].camera).rgb;
    for (std::size_t k = 0; k < rgb.size(); ++k)
      mae += std::abs(rgb[k] - float(scene.test[i].image.rgba[k / 3 * 4 + k % 3]) / 255.0f) /
             double(rgb.size() * views.size());
  }
  CHECK(mae == Approx(model.quality(device, dataset).mae).epsilon(1e-3));
}

TEST_CASE("a dataset says what it left out", "[api]") {
  const test::TemporaryFolder folder;
  test::write_tiny_scene(folder.path() / "scene", {});
  CHECK(Dataset(folder.path() / "scene").warnings().empty());
  std::filesystem::resize_file(folder.path() / "scene/train/r_1.png", 100);
  const Dataset dataset(folder.path() / "scene");
  REQUIRE(dataset.warnings().size() == 1);
  CHECK_THAT(dataset.warnings()[0], Catch::Contains("left out 1 photograph: ") && Catch::Contains("r_1.png"));
}

TEST_CASE("the library reports invalid input in one line", "[api]") {
  using Catch::Contains;
  const test::TemporaryFolder folder;
  test::write_tiny_scene(folder.path() / "scene", {});
  const Dataset dataset(folder.path() / "scene");
  Device device("cpu");
  CHECK_THROWS_WITH(Dataset(folder.path() / "nowhere"), Contains("nowhere"));
  CHECK_THROWS_WITH(Device("toaster"), Contains("toaster"));
  CHECK_THROWS_WITH(Training(device, dataset, {.preset = "slow"}), Contains("there is no 'slow'"));
  CHECK_THROWS_WITH(Training(device, dataset, {.set = {"hubber=1"}}), Contains("nearest is huber"));
  CHECK_THROWS_WITH(Model::read(folder.path() / "scene/transforms_train.json"), Contains("transforms_train.json"));
  Training training(device, dataset, {.preset = "fast", .steps = 1, .triangles = 20});
  training.run();
  CHECK_THROWS_WITH(training.model().render(device, Camera{}), Contains("camera: 0 x 0"));
  CHECK_THROWS_WITH((Picture{4, 4, {}}.write_png(folder.path() / "x.png")),
                    Contains("x.png: the picture has 0 values, expected 4 x 4 x 3"));
}
