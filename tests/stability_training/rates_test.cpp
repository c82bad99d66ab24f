// Tests engine/train/quality/training_fit.h and the optimisers with learning rates that are far too high.
#include "stability_training/small_training.h"

using namespace trisoup;
using namespace trisoup::test;

namespace {

train::Settings faster(double train::Settings::*rate, double factor) {
  train::Settings settings = small_settings();
  settings.*rate *= factor;
  return settings;
}

}  // namespace

TEST_CASE("learning rates ten and a hundred times too high", "[rates]") {
  auto gpu = open_device();
  static const double usual = train_through(*gpu, cube(), small_settings()).test_psnr;
  const auto [name, rate] =
      GENERATE(table<const char*, double train::Settings::*>({{"textures", &train::Settings::lr_texture},
                                                              {"MLP", &train::Settings::lr_mlp},
                                                              {"vertices", &train::Settings::lr_vertex}}));
  const double factor = GENERATE(10.0, 100.0);
  const Outcome outcome = train_through(*gpu, cube(), faster(rate, factor));
  WARN(name << " x " << factor << ": test " << outcome.test_psnr << " dB, usual " << usual);
  CHECK_FALSE(outcome.fit.nothing_learnt());
  CHECK(outcome.test_psnr > usual - 2.5);
}

TEST_CASE("learning rates a million times too high", "[rates]") {
  auto gpu = open_device();
  // Adam's steps have the length of the learning rate for any gradient, and rates fall to a hundredth: textures
  // saturate and recover.
  for (const auto rate : {&train::Settings::lr_texture, &train::Settings::lr_mlp}) {
    const Outcome outcome = train_through(*gpu, cube(), faster(rate, 1e6));
    WARN("x 1e6: training " << outcome.fit.psnr << ", plain " << outcome.fit.mean_colour_psnr);
    CHECK_FALSE(outcome.fit.nothing_learnt());
  }
  // Triangles thousands of scene sizes away do not recover. It is reported at the refinement that finds none left, or
  // at the end.
  try {
    const Outcome outcome = train_through(*gpu, cube(), faster(&train::Settings::lr_vertex, 1e6));
    WARN("vertices x 1e6: training " << outcome.fit.psnr << ", plain " << outcome.fit.mean_colour_psnr);
    CHECK(outcome.fit.nothing_learnt());
  } catch (const Error& e) {
    CHECK_THAT(e.what(),
               Catch::Matchers::Contains("shows a single triangle") && Catch::Matchers::Contains("lr_vertex"));
  }
}
