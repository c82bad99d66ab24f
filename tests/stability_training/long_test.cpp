// Tests trainings that go on for long on small photographs.
#include "stability_training/small_training.h"

using namespace trisoup;
using namespace trisoup::test;

TEST_CASE("long trainings do not learn by heart what lies at the centres of pixels", "[long]") {
  TinyScene tiny;
  tiny.width = tiny.height = 48;
  tiny.train = 24;
  tiny.test = 12;
  const scene::Scene scene = load_tiny(tiny);
  auto gpu = open_device();
  const auto trained = [&](std::uint64_t steps, double jitter) {
    train::Settings settings = small_settings(steps);
    settings.triangles = 300;
    settings.rate_end = settings.rate_vertex_end = 0.1;
    settings.rate_vertex = train::vertex_rate(settings, 0.3);
    settings.pixel_jitter = jitter;
    const Outcome outcome = train_through(*gpu, scene, settings);
    WARN(steps << " steps, --pixel-jitter " << jitter << ": test " << outcome.test_psnr << ", training " << outcome.fit.psnr << " dB");
    return outcome;
  };
  const double usual = train::published(train::Recipe::synthetic).pixel_jitter;
  const Outcome few = trained(500, usual), many = trained(2000, usual), centres = trained(2000, 0);
  CHECK(many.test_psnr > few.test_psnr + 0.3);
  CHECK(many.test_psnr > centres.test_psnr + 0.3);
  CHECK(many.fit.psnr - many.test_psnr < centres.fit.psnr - centres.test_psnr - 0.8);
}
