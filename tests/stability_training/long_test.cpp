// Tests long trainings on small photographs.
#include "recipe_settings.h"
#include "stability_training/small_training.h"
#include "train/config/schedule.h"

using namespace trisoup;
using namespace trisoup::test;

TEST_CASE("long trainings do not overfit to pixel centres", "[long]") {
  TinyScene tiny;
  tiny.width = tiny.height = 48;
  tiny.train = 24;
  tiny.test = 12;
  const scene::Scene scene = load_tiny(tiny);
  auto gpu = open_device();
  const auto trained = [&](std::uint64_t steps, double jitter, std::uint64_t seed) {
    train::Settings settings = small_settings(steps);
    settings.triangles = 300;
    settings.seed = seed;
    settings.lr_end = settings.lr_vertex_end = 0.1;
    settings.lr_vertex = train::vertex_lr(settings, 0.3);
    settings.pixel_jitter = jitter;
    const Outcome outcome = train_through(*gpu, scene, settings);
    WARN(steps << " steps, seed " << seed << ", pixel_jitter " << jitter << ": test " << outcome.test_psnr
               << ", training " << outcome.fit.psnr << " dB");
    return outcome;
  };
  const double usual = test::settings_of_recipe(train::Recipe::synthetic).pixel_jitter;
  // Results vary by seed: over six seeds, the test views gained 0.2 to 0.9 dB (mean 0.5) and the gap to the training
  // views decreased by 0.2 to 0.9 (mean 0.7).
  constexpr std::uint64_t kSeeds = 2;
  double gained = 0, closer = 0;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    const Outcome many = trained(2000, usual, seed), centres = trained(2000, 0, seed);
    if (seed == 0) CHECK(many.test_psnr > trained(500, usual, seed).test_psnr + 0.3);
    gained += (many.test_psnr - centres.test_psnr) / kSeeds;
    closer += (centres.fit.psnr - centres.test_psnr - many.fit.psnr + many.test_psnr) / kSeeds;
  }
  CHECK(gained > 0.2);
  CHECK(closer > 0.4);
}
