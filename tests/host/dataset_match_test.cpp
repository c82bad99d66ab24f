// Tests engine/run/dataset_match.h: datasets that do not belong to a model are recognised.
#include <catch2/catch.hpp>

#include <functional>
#include <string>
#include <vector>

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

namespace {

/// Test views of `scene` after the split of the model is applied to it as to a dataset, and the lines about it.
struct Applied {
  std::vector<std::string> test, lines;
};

/// drop: index of a view that is missing today, in name order. rename: gives each photograph its name of today.
Applied applied(const soup::ModelFile& model, const test::TinyScene& tiny, std::size_t drop,
                const std::function<std::string(const std::string&)>& rename = {}) {
  Applied result;
  std::vector<std::string> names;
  std::vector<bool> test;
  scene::LoadOptions options;
  options.choose_test = [&](const std::vector<std::string>& all, const std::vector<scene::Camera>& cameras,
                            std::vector<bool>& flags) {
    std::vector<scene::Camera> left;
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (i == drop) continue;
      names.push_back(rename ? rename(all[i]) : all[i]);
      left.push_back(cameras[i]);
    }
    test.assign(names.size(), false);
    for (std::size_t i = 0; i < names.size(); i += 2) test[i] = true;  // as --test-every 2 would count today
    result.lines = train::apply_recorded_split(model, names, left, test);
    REQUIRE(flags.size() == all.size());
  };
  load(tiny, options);
  for (std::size_t i = 0; i < names.size(); ++i)
    if (test[i]) result.test.push_back(names[i]);
  return result;
}

constexpr std::size_t kNone = 100;
using Names = std::vector<std::string>;

}  // namespace

TEST_CASE("the test views of a training stay test views when photographs are missing or renamed", "[fits]") {
  const soup::ModelFile model = model_of(load(test::TinyScene{}));
  const Names both{"test/r_0.png", "test/r_1.png"};
  CHECK(applied(model, {}, kNone).test == both);
  CHECK(applied(model, {}, kNone).lines.empty());
  CHECK(applied(model, {}, 4).test == both);  // a training view is missing
  const Applied less = applied(model, {}, 0);
  CHECK(less.test == Names{"test/r_1.png"});
  CHECK(less.lines == Names{"1 of the 2 test views of the training are missing: test/r_0.png"});

  const auto upper = [](const std::string& name) { return "TEST" + name.substr(name.find('/'), 4) + ".JPG"; };
  const auto only_tests = [&](const std::string& name) { return name.starts_with("test") ? upper(name) : name; };
  CHECK(applied(model, {}, kNone, only_tests).test == Names{"TEST/r_0.JPG", "TEST/r_1.JPG"});
  const auto moved = [](const std::string& name) {
    return name == "test/r_1.png" ? std::string("new\\r_1.png") : name;
  };
  // train/r_1.png has the same file name, so it is not known which one new/r_1.png is.
  const Applied ambiguous = applied(model, {}, kNone, moved);
  CHECK(ambiguous.test == Names{"test/r_0.png"});
  REQUIRE(ambiguous.lines.size() == 2);
  CHECK(ambiguous.lines[1].starts_with("the model does not know 1 of 8 photographs, which are not test views: new"));
}

TEST_CASE("a dataset that is not the model's keeps its own split", "[fits]") {
  const soup::ModelFile model = model_of(load(test::TinyScene{}));
  const auto other = [](const std::string& name) { return "x" + std::to_string(std::hash<std::string>{}(name)); };
  CHECK(applied(model, {}, kNone, other).test.size() == 4);
  test::TinyScene elsewhere;
  elsewhere.scale = 1.5;
  CHECK(applied(model, elsewhere, kNone).test.size() == 4);  // the same names of other views
  CHECK(applied(soup::ModelFile{}, {}, kNone).test.size() == 4);
}

TEST_CASE("another choice of test views is said with the number that was trained on", "[fits]") {
  scene::Scene scene = load(test::TinyScene{});
  const soup::ModelFile model = model_of(scene);
  CHECK(train::split_difference(model, scene, 4, 8).empty());
  std::swap(scene.test[0], scene.train[2]);
  CHECK(train::split_difference(model, scene, 4, 8) ==
        "`test_every` 4 differs from the training's 8: 1 of 2 test views were trained on");
  CHECK(train::split_difference(soup::ModelFile{}, scene, 4, 8).empty());
}
