// Tests engine/run/memory_need.h: the memory estimate and the budgets that fit.
#include <catch2/catch.hpp>

#include "recipe_settings.h"
#include "run/memory_need.h"
#include "run/trainer.h"
#include "train/step/soup_buffers.h"

using namespace trisoup;

namespace {

scene::Scene scene_of(int views, int side) {
  scene::Scene scene;
  scene::View view;
  view.camera.width = view.camera.height = side;
  scene.train.assign(static_cast<std::size_t>(views), view);
  return scene;
}

}  // namespace

TEST_CASE("the largest budget that fits needs at most the given memory, one triangle more does not", "[memory]") {
  const scene::Scene scene = scene_of(20, 200);
  for (const train::Recipe recipe : {train::Recipe::synthetic, train::Recipe::real}) {
    train::Settings s = test::settings_of_recipe(recipe);
    s.init_count = 1000;
    s.triangles = GENERATE(50'000u, 0xffffffffu);
    const std::uint64_t room = 3ull << 30;
    const std::uint32_t fits = train::triangles_that_fit(scene, s, room);
    REQUIRE(fits > 100);
    s.triangles = fits;
    CHECK(train::memory_need(scene, s).total() <= room);
    s.triangles = fits + 1;
    CHECK(train::memory_need(scene, s).total() > room);
  }
}

TEST_CASE("a budget that the scene decides on stays within the memory", "[memory]") {
  const scene::Scene scene = scene_of(20, 200);
  train::Settings s = test::settings_of_recipe(train::Recipe::real);
  s.init = "surface";
  s.triangles = s.init_count = s.most_triangles = 60'000;
  const std::uint64_t need = train::memory_need(scene, s).total();
  train::Settings given = s;
  train::limit_budget(scene, given, need / 2);
  CHECK(given.triangles == 60'000);  // what somebody asked for is an error, not another number
  s.least_shift = 0.05;
  train::limit_budget(scene, s, need);
  CHECK(s.triangles == 60'000);
  train::limit_budget(scene, s, need / 2);
  CHECK(s.triangles < 60'000);
  CHECK(s.triangles > 10'000);
  CHECK((s.init_count == s.triangles && s.most_triangles == s.triangles));
  CHECK(train::memory_need(scene, s).total() <= need / 2);
}

TEST_CASE("depth maps need four bytes per pixel, if they are used", "[memory]") {
  scene::Scene scene = scene_of(20, 200);
  train::Settings s = test::settings_of_recipe(train::Recipe::real);
  const std::uint64_t without = train::memory_need(scene, s).total();
  for (scene::View& view : scene.train) view.depth = {64, 64, std::vector<float>(64 * 64, 1.0f)};
  CHECK(train::memory_need(scene, s).total() == without);
  s.lambda_depth = 1;
  CHECK(train::memory_need(scene, s).total() == without + 20 * 64 * 64 * 4);
}

TEST_CASE("a surface needs room for the sums of its textures' pixels after the last step", "[memory]") {
  const scene::Scene scene = scene_of(20, 200);
  train::Settings s = test::settings_of_recipe(train::Recipe::real);
  s.triangles = s.init_count = s.most_triangles = 60'000;
  s.init = "points";
  const std::uint64_t points = train::memory_need(scene, s).total();
  s.init = "surface";
  CHECK(train::memory_need(scene, s).total() >= points + 60'000ull * 32 * soup::samples_at(s.level_max));
}

TEST_CASE("smaller_run proposes a budget that fits after memory ran out", "[memory]") {
  const scene::Scene scene = scene_of(20, 200);
  for (const train::Recipe recipe : {train::Recipe::synthetic, train::Recipe::real}) {
    train::Settings s = test::settings_of_recipe(recipe);
    s.triangles = s.init_count = 15'000;
    s.most_triangles = recipe == train::Recipe::real ? 60'000 : 0;
    const std::uint64_t foreseen = train::memory_need(scene, s).total();
    // Another program uses half the memory. The training needs its estimate, or 1.5 times that.
    const auto [with_half, half] = train::smaller_run(scene, s, foreseen, foreseen / 2);
    const auto [beyond, third] = train::smaller_run(scene, s, foreseen + foreseen / 2, foreseen / 2);
    CHECK(half == foreseen / 2);
    CHECK(third == Approx(static_cast<double>(foreseen) / 3).epsilon(1e-6));
    CHECK(beyond > 0);
    CHECK(beyond < with_half);
    // If splitting may reach four times the budget, half the memory is enough for the budget itself.
    CHECK((recipe == train::Recipe::real ? with_half == 15'000 : with_half < 15'000));
    s.most_triangles = 0;
    s.triangles = beyond;
    CHECK(1.5 * static_cast<double>(train::memory_need(scene, s).total()) <= 0.51 * static_cast<double>(foreseen));
  }
}

TEST_CASE("no budget fits if the initial triangles do not", "[memory]") {
  const scene::Scene scene = scene_of(20, 200);
  train::Settings s = test::settings_of_recipe(train::Recipe::synthetic);
  s.init_count = 10'000'000;
  CHECK(train::triangles_that_fit(scene, s, 1ull << 30) == 0);
  s.init_count = 1000;
  CHECK(train::triangles_that_fit(scene, s, 1ull << 30) > 0);
}

TEST_CASE("splitting is limited by memory, between the budget and eight times the budget", "[memory]") {
  const scene::Scene scene = scene_of(20, 200);
  train::Settings s = test::settings_of_recipe(train::Recipe::real);
  s.triangles = s.init_count = 5000;
  CHECK(train::most_triangles_that_fit(scene, s, 0) == s.triangles);
  CHECK(train::most_triangles_that_fit(scene, s, 1ull << 60) == 8 * s.triangles);
  const std::uint64_t room = 2ull << 30;
  s.most_triangles = train::most_triangles_that_fit(scene, s, room);
  CHECK(s.most_triangles > s.triangles);
  CHECK(train::memory_need(scene, s).total() <= room);
  ++s.most_triangles;
  CHECK(train::memory_need(scene, s).total() > room);
  s.triangles = 0xffffffffu;
  CHECK(train::most_triangles_that_fit(scene, s, 1ull << 60) == s.triangles);
}

TEST_CASE("a rank needs its share of the textures and all other data", "[memory]") {
  const scene::Scene scene = scene_of(4, 50);
  train::Settings s = test::settings_of_recipe(train::Recipe::synthetic);
  s.init_count = 100;
  s.triangles = 100'000;
  const std::uint64_t textures =
      s.triangles * train::texture_bytes(soup::samples_in(s.level_min, s.level_max), soup::samples_at(s.level_max));
  const std::uint64_t rest = train::memory_need(scene, s, 1).soup - textures;
  for (const std::uint32_t ranks : {2u, 4u}) {
    const std::uint64_t need = train::memory_need(scene, s, ranks).soup;
    CHECK(need == rest + textures / ranks);
    CHECK(static_cast<double>(need) < 1.2 * static_cast<double>(textures / ranks));
  }
}

TEST_CASE("the proposed shrinking of images fits, half of it does not", "[memory]") {
  const scene::Scene scene = scene_of(100, 2000);
  train::Settings s = test::settings_of_recipe(train::Recipe::real);
  s.triangles = s.init_count = 1000;
  s.most_triangles = 2000;
  const auto need_at = [&](int side) { return train::memory_need(scene_of(100, side), s).total(); };
  CHECK(train::shrinking_that_fits(scene, s, need_at(1000)) == 2);
  CHECK(train::shrinking_that_fits(scene, s, need_at(1000) - 1) == 4);
  CHECK(train::shrinking_that_fits(scene, s, 1000) == 0);
}

TEST_CASE("the files of a training need room for two checkpoints", "[memory]") {
  train::Settings s = test::settings_of_recipe(train::Recipe::real);
  s.triangles = s.most_triangles = 1000;
  s.level_min = 2, s.level_max = 3;
  // 15 + 45 samples of 8 channels, each a logit with two moments.
  const std::uint64_t textures = 1000ull * 60 * 8 * 12;
  CHECK(train::disk_need(scene_of(3, 10), s) > 2 * textures);
  CHECK(train::disk_need(scene_of(3, 10), s) < 3 * textures);
}
