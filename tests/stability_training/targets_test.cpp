// Tests engine/run/trainer.h with few or uniform photographs and unusual sizes.
#include "stability_training/small_training.h"

using namespace trisoup;
using namespace trisoup::test;

TEST_CASE("a single training view is learnt", "[targets]") {
  TinyScene tiny;
  tiny.train = 1, tiny.test = 0;
  const scene::Scene scene = load_tiny(tiny);
  REQUIRE(scene.train.size() == 1);
  auto gpu = open_device();
  const Outcome one = train_through(*gpu, scene, small_settings());
  WARN("one view: " << one.fit.psnr << " dB, plain colours " << one.fit.mean_colour_psnr);
  CHECK(one.fit.psnr > 20);
}

TEST_CASE("two identical views", "[targets]") {
  TinyScene tiny;
  tiny.train = 2, tiny.test = 0, tiny.identical = true;
  // A dataset with only these views is refused, because it contains no depth information.
  scene::LoadOptions all;
  all.test_every = 0;
  CHECK_THROWS_WITH(load_tiny(tiny, all), Catch::Matchers::Contains("all 2 cameras are at one spot"));
  tiny.train = 1;
  scene::Scene scene = load_tiny(tiny);
  scene.train.push_back(scene.train[0]);
  auto gpu = open_device();
  const Outcome twice = train_through(*gpu, scene, small_settings());
  WARN("two identical views: " << twice.fit.psnr << " dB");
  CHECK(twice.fit.psnr > 20);
}

TEST_CASE("photographs of a single colour", "[targets]") {
  struct Case {
    const char* name;
    std::array<std::uint8_t, 4> pixel;
    scene::BackgroundChoice background;
  };
  using enum scene::BackgroundChoice;
  const auto [name, pixel, background] = GENERATE(
      Case{"white on black", {255, 255, 255, 255}, automatic}, Case{"white on white", {255, 255, 255, 255}, white},
      Case{"black on black", {0, 0, 0, 255}, automatic}, Case{"black on white", {0, 0, 0, 255}, white},
      Case{"transparent", {0, 0, 0, 0}, automatic}, Case{"transparent on black", {90, 90, 90, 0}, black});
  INFO(name);
  TinyScene tiny;
  tiny.plain = pixel;
  scene::LoadOptions load;
  load.background = background;
  const scene::Scene scene = load_tiny(tiny, load);
  auto gpu = open_device();
  train::Settings settings = small_settings();
  settings.init_radius = 0.25, settings.init_box = 0.4;  // so that triangles fill the pictures
  const Outcome outcome = train_through(*gpu, scene, settings);
  WARN(name << ": training " << outcome.fit.psnr << " dB, test " << outcome.test_psnr << " dB, " << outcome.triangles
            << " triangles");
  CHECK(outcome.fit.psnr > 40);
  // If the colour is the background's, triangles without gradients may remain, but must not be visible.
  CHECK(outcome.test_psnr > 30);
}

TEST_CASE("photographs of unusual sizes", "[targets]") {
  // SSIM windows are 11 x 11.
  const auto [width, height, least] = GENERATE(table<int, int, double>(
      {{1, 1, 30}, {7, 5, 13}, {5, 7, 13}, {10, 10, 18}, {11, 10, 18}, {11, 11, 18}, {1, 40, 18}}));
  INFO(width << " x " << height);
  TinyScene tiny;
  tiny.width = width, tiny.height = height;
  const scene::Scene scene = load_tiny(tiny);
  auto gpu = open_device();
  const Outcome outcome = train_through(*gpu, scene, small_settings());
  WARN(width << " x " << height << ": training " << outcome.fit.psnr << " dB, plain " << outcome.fit.mean_colour_psnr
             << ", test " << outcome.test_psnr);
  CHECK(outcome.fit.psnr > least);
}

TEST_CASE("photographs of 17 x 4001 and 4001 x 17 pixels", "[targets]") {
  const bool tall = GENERATE(true, false);
  TinyScene tiny;
  tiny.width = tall ? 17 : 4001, tiny.height = tall ? 4001 : 17;
  tiny.train = 2, tiny.test = 1;
  const scene::Scene scene = load_tiny(tiny);
  auto gpu = open_device();
  train::Settings settings = small_settings(50);
  settings.batch = 1;
  const Outcome outcome = train_through(*gpu, scene, settings);
  WARN(tiny.width << " x " << tiny.height << ": training " << outcome.fit.psnr << " dB, plain "
                  << outcome.fit.mean_colour_psnr);
  CHECK_FALSE(outcome.fit.nothing_learnt());
}
