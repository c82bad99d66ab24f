// Tests engine/train/resample.h: few and many triangles, and none that is seen.
#include "stability_training/small_training.h"

using namespace trisoup;
using namespace trisoup::test;

TEST_CASE("a start and a budget of any size", "[budgets]") {
  static const scene::Scene scene = load_tiny({});
  const auto [start, budget] = GENERATE(table<std::uint32_t, std::uint32_t>({{1, 1}, {10, 10}, {10, 100}, {300, 20}, {1, 50}}));
  const auto recipe = GENERATE(train::Recipe::synthetic, train::Recipe::real);
  INFO("start " << start << ", budget " << budget << ", " << train::to_string(recipe));
  auto gpu = open_device();
  train::Settings settings = small_settings(100);
  settings.recipe = recipe;
  settings.init_count = start;
  settings.triangles = budget;
  settings.init_radius = start < 100 ? 0.15 : 0.05;
  settings.init_box = start < 100 ? 0.02 : 0.185;
  const Outcome outcome = train_through(*gpu, scene, settings);
  WARN(start << " -> " << budget << " " << train::to_string(recipe) << ": " << outcome.triangles << " triangles, training " << outcome.fit.psnr << ", plain "
             << outcome.fit.plain_psnr);
}

TEST_CASE("a hundred thousand triangles", "[budgets][slow]") {
  static const scene::Scene scene = load_tiny({});
  const auto [start, budget] = GENERATE(table<std::uint32_t, std::uint32_t>({{100'000, 80}, {200, 100'000}}));
  auto gpu = open_device();
  train::Settings settings = small_settings(40);
  settings.init_count = start;
  settings.triangles = budget;
  settings.level_min = settings.level_max = 0;
  if (start == 100'000) settings.init_radius = 0.0025;
  const Outcome outcome = train_through(*gpu, scene, settings);
  WARN(start << " -> " << budget << ": " << outcome.triangles << " triangles, training " << outcome.fit.psnr << ", plain " << outcome.fit.plain_psnr);
}
