// Tests how much the result of a training depends on the seed.
#include <cstdlib>

#include "stability_training/small_training.h"

using namespace trisoup;
using namespace trisoup::test;

TEST_CASE("different seeds give similar results", "[seeds]") {
  // TRISOUP_SEEDS: number of seeds; docs/stability.md has results for 50.
  const char* given = std::getenv("TRISOUP_SEEDS");
  const std::uint64_t seeds = given ? std::strtoull(given, nullptr, 10) : 5;
  TinyScene tiny;
  tiny.test = 12;  // the mean of two views varies more than the model does
  const scene::Scene scene = load_tiny(tiny);
  auto gpu = open_device();
  double sum = 0, squares = 0, low = 1e9, high = 0;
  for (std::uint64_t seed = 0; seed < seeds; ++seed) {
    train::Settings settings = small_settings();
    settings.seed = seed;
    const double psnr = train_through(*gpu, scene, settings).test_psnr;
    sum += psnr, squares += psnr * psnr;
    low = std::min(low, psnr), high = std::max(high, psnr);
  }
  const double n = static_cast<double>(seeds), mean = sum / n,
               deviation = std::sqrt(std::max(0.0, (squares - n * mean * mean) / (n - 1)));
  WARN(seeds << " seeds: test PSNR " << mean << " dB, standard deviation " << deviation << ", " << low << " to "
             << high);
  CHECK(deviation < 0.3);
}
