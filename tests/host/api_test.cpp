// Tests the public headers (engine/api/trisoup): camera coordinates, reading models back, errors.
#include <catch2/catch.hpp>

#include <cmath>
#include <filesystem>
#include <memory>
#include <numeric>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <trisoup/trisoup.h>

#include "api/impl.h"
#include "base/atomic_file.h"
#include "base/read_file.h"
#include "run/edited_model.h"
#include "scene/scene.h"
#include "soup/soup.h"
#include "temporary_folder.h"
#include "tiny_scene.h"

using namespace trisoup;
using Catch::Contains;

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

namespace {

/// A dataset of a tiny scene, as the test cases of this file train it.
struct TinyDataset {
  test::TemporaryFolder folder;
  Dataset dataset = [this] {
    test::write_tiny_scene(folder.path() / "scene", {});
    return Dataset(folder.path() / "scene");
  }();
  Device device{"cpu"};
  TrainingOptions options{.preset = "fast",
                          .steps = 20,
                          .triangles = 60,
                          .set = {"refine_every=10", "init_count=120", "init_radius=0.2", "init_box=0.7"}};

  std::vector<Photograph> photographs() const {
    std::vector<Photograph> all;
    for (const bool test : {false, true}) {
      const std::vector<View> views = test ? dataset.test_views() : dataset.training_views();
      for (std::size_t i = 0; i < views.size(); ++i) {
        const PhotographPixels pixels = dataset.photograph(test, i);
        all.push_back({views[i].name, views[i].camera, {pixels.rgba.begin(), pixels.rgba.end()}, {}, test});
      }
    }
    return all;
  }
};

}  // namespace

TEST_CASE("pixels of the library's renderings belong together", "[api]") {
  TinyDataset tiny;
  Training training(tiny.device, tiny.dataset, tiny.options);
  training.run();
  const Model model = training.model();
  const Camera camera = resized(tiny.dataset.test_views().front().camera, 40, 30);
  RenderOptions all{
      .alpha = true, .triangle = true, .barycentrics = true, .depth = true, .normal = true, .features = true};
  all.background = {0.25f, 0.5f, 0.75f};
  const Rendering r = model.render(tiny.device, camera, all);
  REQUIRE((r.colour.size() == 3600 && r.alpha.size() == 1200 && r.triangle.size() == 1200 &&
           r.barycentrics.size() == 3600 && r.depth.size() == 1200 && r.normal.size() == 3600 &&
           r.features.size() == 9600));
  const std::span<const float> vertices = model.vertices();
  std::size_t shown = 0;
  for (std::size_t i = 0; i < 1200; ++i) {
    const bool covered = r.triangle[i] >= 0;
    REQUIRE((r.alpha[i] == (covered ? 1.0f : 0.0f) && std::isfinite(r.depth[i]) == covered));
    if (!covered) {
      CHECK((r.features[8 * i] == 0 && r.features[8 * i + 7] == 0));
      CHECK((r.colour[3 * i] == 0.25f && r.colour[3 * i + 2] == 0.75f));
      continue;
    }
    ++shown;
    // The point of the barycentrics is as deep as `depth` says.
    double depth = camera.world_to_camera[11];
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (std::size_t corner = 0; corner < 3; ++corner)
        depth += camera.world_to_camera[8 + axis] * double(r.barycentrics[3 * i + corner]) *
                 double(vertices[9 * std::size_t(r.triangle[i]) + 3 * corner + axis]);
    CHECK(depth == Approx(r.depth[i]).epsilon(1e-4));
    CHECK(r.features[8 * i + 7] > 0.499f);  // it is visible
  }
  CHECK((shown > 50 && shown < 1200));
  CHECK(model.render(tiny.device, camera, {.colour = false}).colour.empty());
}

TEST_CASE("the numbers of a model are complete", "[api]") {
  TinyDataset tiny;
  Training training(tiny.device, tiny.dataset, tiny.options);
  training.run();
  const Model model = training.model();
  const std::size_t n = model.triangles();
  REQUIRE((model.vertices().size() == 9 * n && model.faces().size() == 3 * n && model.texture_levels().size() == n));
  std::size_t samples = 0;
  for (std::size_t t = 0; t < n; ++t) {
    REQUIRE(model.texture_offsets()[t] == samples);
    samples += soup::samples_at(model.texture_levels()[t]);
  }
  REQUIRE((model.texels().size() == 8 * samples && model.features().size() == 8 * samples));
  CHECK(model.features()[3] == float(model.texels()[3]) / 255.0f);
  std::size_t parameters = 0;
  for (const Layer& layer : model.mlp()) parameters += layer.weights.size() + layer.bias.size();
  CHECK(parameters == soup::Mlp::kParameters);
  CHECK(model.cameras().size() == tiny.dataset.training_views().size() + tiny.dataset.test_views().size());
  CHECK_THAT(model.settings(), Contains("\"steps\":20"));
  // Each view's quality, and their mean.
  const Evaluation e = model.evaluate(tiny.device, tiny.dataset);
  REQUIRE(e.views.size() == 2);
  for (const Measure& measure : measures()) {
    const double mean = (e.views[0].quality.*measure.member + e.views[1].quality.*measure.member) / 2;
    if (std::string(measure.name) == "ms_ssim")
      CHECK((std::isnan(mean) && std::isnan(e.mean.ms_ssim)));  // the pictures are too small
    else
      CHECK(mean == Approx(e.mean.*measure.member));
  }
  CHECK((e.mean.covisible > 0 && e.mean.covisible < 1 && e.mean.psnr_covisible != e.mean.psnr));
  const Evaluation seen = model.evaluate(tiny.device, tiny.dataset, true);
  CHECK((seen.views.size() == 6 && std::isnan(seen.mean.covisible) && std::isnan(seen.mean.psnr_covisible)));
}

TEST_CASE("photographs in memory give the dataset of their files", "[api]") {
  TinyDataset tiny;
  std::vector<Photograph> photographs = tiny.photographs();
  const Dataset taken(photographs, {}, {.background = "white"});
  REQUIRE((taken.training_views().size() == 6 && taken.test_views().size() == 2));
  for (std::size_t i = 0; i < 16; ++i)
    CHECK(taken.training_views()[3].camera.world_to_camera[i] ==
          Approx(tiny.dataset.training_views()[3].camera.world_to_camera[i]).margin(1e-12));
  // To files and back, with a mask and points.
  photographs[1].mask.assign(24 * 24, 255);
  photographs[1].mask[5] = 0;
  const Dataset masked(photographs, {{0, 0.1, 0.2, 0.3, 0, 0}, {1, 2, 3, 4, 5, 6}});
  masked.write_colmap(tiny.folder.path() / "colmap");
  masked.write_transforms(tiny.folder.path() / "transforms");
  for (const char* name : {"colmap", "transforms"}) {
    const Dataset again(tiny.folder.path() / name);
    CHECK(again.photograph(false, 1).rgba[4 * 5 + 3] == 0);
    CHECK(again.points().positions.size() == 6);
    CHECK(again.points().colours == masked.points().colours);
    CHECK(again.test_views().size() == 2);
  }
  CHECK_THROWS_WITH(masked.write_colmap(tiny.folder.path() / "colmap"), Contains("not an empty folder"));
  CHECK_THROWS_WITH(taken.photograph(true, 2), Contains("there is no view 2"));

  const auto refused = [&](const auto& change) {
    std::vector<Photograph> changed = tiny.photographs();
    change(changed[0]);
    return Dataset(changed);
  };
  CHECK_THROWS_WITH(refused([](Photograph& p) { p.rgba.pop_back(); }), Contains("r_0.png: is 24 x 24"));
  CHECK_THROWS_WITH(refused([](Photograph& p) { p.mask = {0}; }), Contains("its mask has 1 values"));
  CHECK_THROWS_WITH(refused([](Photograph& p) { p.name.clear(); }), Contains("has no name"));
  CHECK_THROWS_WITH(refused([](Photograph& p) { p.camera.fx = NAN; }), Contains("focal lengths are nan"));
  CHECK_THROWS_WITH(refused([](Photograph& p) { p.camera.cx = -1; }), Contains("principal point"));
  CHECK_THROWS_WITH(refused([](Photograph& p) { p.camera.world_to_camera[0] = 3; }), Contains("not a rotation"));
  CHECK_THROWS_WITH(Dataset(std::vector<Photograph>{}), Contains("there are none"));
}

TEST_CASE("a training shows its pictures, takes gradients and goes on from checkpoints", "[api]") {
  TinyDataset tiny;
  const auto trained = [&](const TrainingCallbacks& callbacks) {
    Training training(tiny.device, tiny.dataset, tiny.options);
    training.run(callbacks);
    const Model model = training.model();
    return std::vector(model.file().begin(), model.file().end());
  };
  int pictures = 0;
  TrainingCallbacks looks;
  looks.image_loss = [&](StepPicture& picture) {
    ++pictures;
    REQUIRE(picture.colour.size() == 3 * std::size_t(picture.width) * std::size_t(picture.height));
    REQUIRE((picture.target.size() == picture.colour.size() && picture.gradient.size() == picture.colour.size()));
  };
  const auto plain = trained({});
  CHECK(trained(looks) == plain);  // gradients of 0 change nothing
  CHECK(pictures >= 40);
  TrainingCallbacks pulls;
  pulls.image_loss = [](StepPicture& picture) { picture.gradient.assign(picture.gradient.size(), 0.01f); };
  CHECK(trained(pulls) != plain);
  pulls.image_loss = [](StepPicture& picture) { picture.gradient[0] = NAN; };
  CHECK_THROWS_WITH(trained(pulls), Contains("a gradient is not finite"));

  Training training(tiny.device, tiny.dataset, tiny.options);
  int asked = 0;
  training.run({.interrupted = [&] { return ++asked > 0; }});
  CHECK((training.step() == 0 && asked == 1));
  training.run([](const TrainingProgress& p) { return p.step < 10; }, 10);
  training.write_checkpoint(tiny.folder.path() / "checkpoint");
  Training resumed = Training::resume(tiny.device, tiny.dataset, tiny.folder.path() / "checkpoint");
  CHECK(resumed.step() == 10);
  resumed.run();
  const Model model = resumed.model();
  CHECK(std::vector(model.file().begin(), model.file().end()) == plain);

  TrainingOptions given{.preset = "fast", .steps = 5};
  given.start_vertices = {0, 0, 0, 0.2, 0, 0, 0, 0.2, 0};
  given.start_colours = std::vector<float>(9, 0.25f);
  CHECK(Training(tiny.device, tiny.dataset, given).triangles() == 1);
  given.start_colours.pop_back();
  CHECK_THROWS_WITH(Training(tiny.device, tiny.dataset, given), Contains("8 colour values"));
  CHECK_THROWS_WITH(Training(tiny.device, tiny.dataset, {.set = {"target_psnr=30"}}), Contains("soup-simplify"));
}

TEST_CASE("a training leaves out what was removed, and its dataset does not", "[api]") {
  TinyDataset tiny;
  const std::filesystem::path original = tiny.folder.path() / "original.glb", rest = tiny.folder.path() / "rest.glb";
  {
    Training training(tiny.device, tiny.dataset, tiny.options);
    training.run();
    training.model().write(original);
  }
  const train::EditedModel file(original);
  std::vector<std::uint32_t> kept(file.model().triangles() / 2);
  std::iota(kept.begin(), kept.end(), 0u);
  write_file_atomically(rest, file.encoded(kept));
  TrainingOptions options{.preset = "fast", .steps = 10, .set = {"init=" + rest.string()}};
  Training filling(tiny.device, tiny.dataset, options);
  options.set.push_back("removed_from=" + original.string());
  Training training(tiny.device, tiny.dataset, options);
  CHECK(training.evaluate().mean.mae < filling.evaluate().mean.mae);  // the same triangles before the first step
  const auto& rgba = tiny.dataset.impl().scene.train[0].image.rgba;
  for (std::size_t i = 3; i < rgba.size(); i += 4) REQUIRE(rgba[i] >= 128);
  training.run([](const TrainingProgress& p) { return p.step < 5; }, 5);
  training.write_checkpoint(tiny.folder.path() / "checkpoint");
  training.run();
  Training resumed = Training::resume(tiny.device, tiny.dataset, tiny.folder.path() / "checkpoint");
  resumed.run();
  const Model one = training.model(), other = resumed.model();
  CHECK(std::vector(one.file().begin(), one.file().end()) == std::vector(other.file().begin(), other.file().end()));
  std::filesystem::remove(original);
  CHECK_THROWS_WITH(Training::resume(tiny.device, tiny.dataset, tiny.folder.path() / "checkpoint"),
                    Contains("original.glb: is not there, but `removed_from` names it"));
}

TEST_CASE("loading and the start of a training can be interrupted", "[api]") {
  const TinyDataset tiny;
  const Interruption now = [] { return true; };
  CHECK_THROWS_AS(Dataset(tiny.folder.path() / "scene", {.interrupted = now}), Interrupted);
  TrainingOptions interrupted = tiny.options;
  interrupted.interrupted = now;
  CHECK_THROWS_AS(Training(tiny.device, tiny.dataset, interrupted), Interrupted);
  // Dataset and device are as before.
  const auto trained = [&](const Device& device, const Dataset& dataset) {
    Training training(device, dataset, tiny.options);
    training.run();
    const Model model = training.model();
    return std::vector<std::byte>(model.file().begin(), model.file().end());
  };
  CHECK(trained(tiny.device, tiny.dataset) == trained(Device("cpu"), Dataset(tiny.folder.path() / "scene")));
}

TEST_CASE("a model does not keep the devices that have rendered it", "[api]") {
  const TinyDataset tiny;
  const Camera camera = tiny.dataset.test_views().front().camera;
  std::optional<Training> training(std::in_place, tiny.device, tiny.dataset, tiny.options);
  std::optional<Model> model = training->model();
  std::optional<Device> device(std::in_place, "cpu");
  const std::weak_ptr<Device::Impl> watched = device->impl();
  const std::vector<float> before = model->render(*device, camera).rgb;
  device.reset();
  CHECK(watched.expired());
  device.emplace("cpu");
  CHECK(model->render(*device, camera).rgb == before);
  const auto on_device = [&] { return device->impl()->models.size(); };
  CHECK(on_device() == 1);
  CHECK(training->model().render(*device, camera).rgb == before);
  CHECK(on_device() == 1);
  model.reset();
  CHECK(on_device() == 0);
}

TEST_CASE("a dataset says what it left out", "[api]") {
  const test::TemporaryFolder folder;
  test::write_tiny_scene(folder.path() / "scene", {});
  CHECK(Dataset(folder.path() / "scene").warnings().empty());
  std::filesystem::resize_file(folder.path() / "scene/train/r_1.png", 100);
  const Dataset dataset(folder.path() / "scene");
  REQUIRE(dataset.warnings().size() == 1);
  CHECK_THAT(dataset.warnings()[0], Contains("left out 1 photograph: ") && Contains("r_1.png"));
}

TEST_CASE("the library reports invalid input in one line", "[api]") {
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
