// Tests engine/train/topology/refine.h: few triangles, many triangles, and no visible triangle.
#include "stability_training/small_training.h"

using namespace trisoup;
using namespace trisoup::test;

namespace {

/// The budget of the synthetic recipe is a minimum if there are enough pixels; that of the real recipe is a maximum.
void check_budget(const Outcome& outcome, const train::Settings& settings) {
  CHECK(outcome.triangles > 0);
  if (settings.recipe == train::Recipe::synthetic)
    CHECK(outcome.triangles >= settings.triangles);
  else
    CHECK(outcome.triangles <= settings.triangles);
}

/// PSNR of the background alone over the training views, dB.
double empty_psnr(const scene::Scene& scene) {
  double squares = 0, values = 0;
  for (const scene::View& view : scene.train)
    for (std::size_t i = 0; i < view.image.rgba.size(); ++i)
      if (i % 4 < 3)
        squares += std::pow(view.image.rgba[i] / 255.0 - scene.background[static_cast<int>(i % 4)], 2), ++values;
  return -10 * std::log10(squares / values);
}

}  // namespace

TEST_CASE("starts and budgets of different sizes", "[budgets]") {
  const scene::Scene& scene = cube();
  const auto [start, budget] = GENERATE(table<std::uint32_t, std::uint32_t>({{1, 1}, {10, 10}, {10, 100}, {300, 20}}));
  const auto recipe = GENERATE(train::Recipe::synthetic, train::Recipe::real);
  auto gpu = open_device();
  train::Settings settings = small_settings(100);
  settings.recipe = recipe;
  settings.init_count = start;
  settings.triangles = budget;
  if (start < 100) settings.init_radius = 0.15, settings.init_box = 0.02;
  const Outcome outcome = train_through(*gpu, scene, settings);
  WARN(start << " to " << budget << ", " << train::to_string(recipe) << ": " << outcome.triangles
             << " triangles, training " << outcome.fit.psnr << " dB, empty " << empty_psnr(scene));
  check_budget(outcome, settings);
  if (start >= 10) CHECK(outcome.fit.psnr > empty_psnr(scene));
}

TEST_CASE("a hundred thousand triangles", "[budgets][slow]") {
  const scene::Scene& scene = cube();
  auto gpu = open_device();
  train::Settings settings = small_settings(40);
  settings.level_min = settings.level_max = 0;
  SECTION("at the start") {
    settings.init_count = 100'000;
    settings.triangles = 100;
    settings.init_radius = 0.01;
    const Outcome outcome = train_through(*gpu, scene, settings);
    WARN("100000 to 100: " << outcome.triangles << " triangles, training " << outcome.fit.psnr << " dB, empty "
                           << empty_psnr(scene));
    check_budget(outcome, settings);
    CHECK_FALSE(outcome.fit.nothing_learnt());
  }
  SECTION("as the budget for pictures of 576 pixels") {
    settings.init_count = 200;
    settings.triangles = 100'000;
    const Outcome outcome = train_through(*gpu, scene, settings);
    WARN("200 to 100000: " << outcome.triangles << " triangles, training " << outcome.fit.psnr << " dB, empty "
                           << empty_psnr(scene));
    // There are too few pixels for the budget. The limit is what the pictures used for counting, 64 x 64, can show.
    CHECK(outcome.triangles > settings.init_count);
    CHECK(outcome.triangles <= scene.train.size() * 64 * 64 / 4);
    CHECK(outcome.fit.psnr > 12.0);
  }
}

TEST_CASE("a start that no view shows is an error", "[budgets]") {
  const scene::Scene& scene = cube();
  const auto recipe = GENERATE(train::Recipe::synthetic, train::Recipe::real);
  auto gpu = open_device();
  train::Settings settings = small_settings(40);
  settings.recipe = recipe;
  settings.init_centre = {0, 0, 10};
  CHECK_THROWS_WITH(train_through(*gpu, scene, settings),
                    Catch::Matchers::Contains("no training view shows a single triangle; check the poses"));
}
