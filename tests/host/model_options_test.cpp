// Tests engine/run/model_options.h: scenes that no model file can store are refused before they are trained.
#include <catch2/catch.hpp>

#include "run/model_options.h"
#include "scene_temporary_folder.h"
#include "tiny_scene.h"

using namespace trisoup;
using Catch::Contains;

namespace {

scene::Scene tiny() {
  const test::TemporaryFolder folder;
  test::write_tiny_scene(folder.path(), {});
  return scene::load(folder.path(), {});
}

void check(const scene::Scene& scene) {
  train::check_storable(scene, train::model_options(scene, train::Settings{}, scene::LoadOptions{}));
}

}  // namespace

TEST_CASE("a camera that a model cannot store is refused before training, with its photograph", "[model_options]") {
  CHECK_NOTHROW(check(tiny()));
  scene::Scene scene = tiny();
  scene.train[3].camera.fx = 1e6;
  CHECK_THROWS_WITH(check(scene),
                    Contains("train/r_3.png: a model cannot store its camera: its focal length is 1e+06"));
  scene = tiny();
  scene.test[1].camera.fy = 0.001;
  CHECK_THROWS_WITH(check(scene), Contains("test/r_1.png: "));
}

TEST_CASE("a camera so far away that the scale of the scene cannot be stored is named", "[model_options]") {
  scene::Scene scene = tiny();
  // As find_normalisation scales it: the others are at one point, this one is at a distance of 8.
  for (scene::View& view : scene.train) view.camera.world_to_camera[3] *= 1e-12;
  for (scene::View& view : scene.test) view.camera.world_to_camera[3] *= 1e-12;
  scene.train[2].camera.world_to_camera[3] = {0, 0, 8, 1};
  scene.normalisation.scale = 1e-12;
  CHECK_THROWS_WITH(check(scene), Contains("train/r_2.png: its camera is far away from all others") &&
                                      Contains("scale 1e-12, which a model cannot store"));
}
