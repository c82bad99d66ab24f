// Tests engine/train/training_fit.h and the optimisers: learning rates that are far too high.
#include "stability_training/small_training.h"

using namespace trisoup;
using namespace trisoup::test;

TEST_CASE("learning rates ten and a hundred times too high", "[rates]") {
  static const scene::Scene scene = load_tiny({});
  auto gpu = open_device();
  static const double usual = train_through(*gpu, scene, small_settings()).test_psnr;
  const double factor = GENERATE(10.0, 100.0);
  const auto rate = GENERATE(&train::Settings::rate_texture, &train::Settings::rate_mlp, &train::Settings::rate_vertex);
  train::Settings settings = small_settings();
  settings.*rate *= factor;
  const char* name = rate == &train::Settings::rate_texture ? "textures" : rate == &train::Settings::rate_mlp ? "MLP" : "vertices";
  const Outcome outcome = train_through(*gpu, scene, settings);
  WARN(name << " x " << factor << ": test " << outcome.test_psnr << " (usual " << usual << "), training " << outcome.fit.psnr << ", plain "
            << outcome.fit.plain_psnr << (outcome.fit.diverged() ? ", diverged" : ""));
}
