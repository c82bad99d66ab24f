// Tests engine/run/dataset_match.h: datasets that do not belong to a model are recognised.
#include <catch2/catch.hpp>

#include <nlohmann/json.hpp>

#include "run/dataset_match.h"
#include "scene_temporary_folder.h"
#include "tiny_scene.h"

using namespace trisoup;

namespace {

scene::Scene load(const test::TinyScene& tiny, const scene::LoadOptions& options = {}) {
  const test::TemporaryFolder folder;
  test::write_tiny_scene(folder.path(), tiny);
  return scene::load(folder.path(), options);
}

soup::ModelFile model_of(const scene::Scene& scene) {
  soup::ModelFile file;
  file.model.centre = scene.normalisation.centre;
  file.model.scale = scene.normalisation.scale;
  for (const auto& [views, test] : {std::pair(&scene.test, true), {&scene.train, false}})
    for (const scene::View& view : *views) file.cameras.push_back({view.name, test, view.camera});
  file.settings["dataset"] = train::fingerprints_of(scene);
  return file;
}

}  // namespace

TEST_CASE("a dataset other than that of the training is recognised", "[fits]") {
  const scene::Scene own = load(test::TinyScene{});
  const soup::ModelFile model = model_of(own);
  CHECK(train::mismatch(model, own, true, "d").empty());

  // The same dataset at a lower resolution, with another split or other file names matches.
  scene::LoadOptions half;
  half.downscale = 2;
  CHECK(train::mismatch(model, load(test::TinyScene{}, half), false, "d").empty());
  scene::Scene renamed = own;
  for (scene::View& view : renamed.test) view.name = "other/" + view.name;
  for (scene::View& view : renamed.train) view.name = "other/" + view.name;
  CHECK(train::mismatch(model, renamed, true, "d").empty());

  test::TinyScene more;
  more.train = 7;
  CHECK(train::mismatch(model, load(more), true, "d").starts_with("d: poses or lenses of "));
  test::TinyScene larger;
  larger.scale = 1.1;
  CHECK(train::mismatch(model, load(larger), true, "d")
            .starts_with("d: poses or lenses of 8 of 8 views differ from those "));
  scene::Scene elsewhere = load(larger);
  for (auto* views : {&elsewhere.test, &elsewhere.train})
    for (scene::View& view : *views) view.name = "other/" + view.name;
  CHECK(train::mismatch(model, elsewhere, true, "d")
            .starts_with("d: 8 of 8 views match no camera of the model, by pose or by name (first: "
                         "other/test/r_0.png); "));
  scene::Scene wide = own;
  for (scene::View& view : wide.test) view.camera.fx *= 1.05;
  CHECK(train::mismatch(model, wide, true, "d").starts_with("d: poses or lenses of 2 of 8 views "));

  // The scenes of NeRF-Synthetic have the same cameras with different photographs.
  test::TinyScene green;
  green.plain = {0, 200, 0, 255};
  CHECK(train::mismatch(model, load(green), true, "d")
            .starts_with("d: test photographs or masks differ from those of the training, the cameras match; "));
  CHECK(train::mismatch(model, load(green), false, "d").empty());

  soup::ModelFile foreign;
  CHECK(train::mismatch(foreign, own, true, "d").empty());
}
