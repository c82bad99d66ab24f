// Tests engine/train/quality/image_metrics.h and the means of engine/train/quality/evaluate.h: metrics without valid
// pixels have no value.
#include <catch2/catch.hpp>

#include <limits>

#include <nlohmann/json.hpp>

#include "train/quality/evaluate.h"

using namespace trisoup;
using namespace trisoup::train;

namespace {

Image plain(int side, std::uint8_t value, std::uint8_t mask) {
  Image image{side, side, {}};
  for (int i = 0; i < side * side; ++i)
    for (const std::uint8_t channel : {value, value, value, mask}) image.rgba.push_back(channel);
  return image;
}

std::vector<float> colour(int side, float value) { return std::vector<float>(std::size_t(3 * side * side), value); }

}  // namespace

TEST_CASE("a view without valid pixels has no PSNR and is left out of means", "[metrics]") {
  const ImageMetrics none = compare(colour(16, 1.0f), plain(16, 255, 0));
  CHECK(none.pixels == 0);
  CHECK(none.psnr == 0);
  const ImageMetrics some = compare(colour(16, 0.5f), plain(16, 255, 255));
  CHECK(some.pixels == 256);
  CHECK(some.psnr == Approx(-20 * std::log10(0.5)));
  CHECK(compare(colour(16, 1.0f), plain(16, 255, 255)).psnr == 100);

  train::Evaluation evaluation;
  evaluation.views = {{"none", none}, {"some", some}};
  evaluation.mean = mean(evaluation.views);
  CHECK(evaluation.mean.psnr == some.psnr);
  CHECK(evaluation.mean.ssim == some.ssim);
  CHECK(evaluation.mean.mae == some.mae);
  const nlohmann::json json = to_json(evaluation);
  for (const char* key : {"psnr", "ssim", "mae", "uncovered"}) {
    CAPTURE(key);
    CHECK(json["views"][0][key].is_null());
    CHECK(json["views"][1][key].is_number());
    CHECK(json[key].is_number());
  }
  CHECK_FALSE(json.contains("flip"));
  // MS-SSIM and FLIP: a view that is too small for MS-SSIM is left out of its mean.
  ImageMetrics perceived = some;
  perceived.flip = 0.25, perceived.ms_ssim = 0.5;
  ImageMetrics small = some;
  small.flip = 0.75;
  evaluation = {{{"none", none}, {"perceived", perceived}, {"small", small}}, {}, {}, true};
  evaluation.mean = mean(evaluation.views);
  const nlohmann::json with = to_json(evaluation);
  CHECK(with["flip"] == 0.5);
  CHECK(with["ms_ssim"] == 0.5);
  CHECK(with["views"][0]["flip"].is_null());
  CHECK(with["views"][1]["flip"] == 0.25);
  CHECK(with["views"][2]["ms_ssim"].is_null());

  evaluation.views = {{"none", none}};
  evaluation.mean = mean(evaluation.views);
  CHECK(to_json(evaluation)["psnr"].is_null());
}

TEST_CASE("each view with enough co-visible pixels has the same weight", "[metrics]") {
  ImageMetrics some;
  some.pixels = 100;
  ImageMetrics bright = some, dark = some;
  bright.psnr = 30, dark.psnr = 20, bright.ssim = 0.9, dark.ssim = 0.5;
  const std::vector<ViewMetrics> views{{"a", some, {}, CovisibleMetrics{0.8, bright, true}},
                                       {"b", some, {}, CovisibleMetrics{0.1, dark, true}},
                                       {"c", some, {}, CovisibleMetrics{0.0, {}, false}},
                                       {"masked out", {}, {}, CovisibleMetrics{0.0, {}, false}}};
  const auto mean = covisible_mean(views);
  REQUIRE(mean);
  CHECK(mean->share == Approx(0.3));
  CHECK(mean->psnr == 25);
  CHECK(mean->ssim == Approx(0.7));
  CHECK(mean->measured == 2);
  CHECK(mean->left_out == 1);
  CHECK_FALSE(covisible_mean({{"a", some}}));
}

TEST_CASE("a picture that is not finite has no quality", "[metrics]") {
  CHECK(psnr_of(0.01) == Approx(20));
  CHECK(psnr_of(0.0) == 100.0);
  CHECK(psnr_of(std::numeric_limits<double>::quiet_NaN()) == 0.0);
  CHECK(psnr_of(std::numeric_limits<double>::infinity()) == 0.0);
}
