// Tests engine/scene/lens/photograph.h and area_resample.h: averages of colour, alpha and mask.
#include <catch2/catch.hpp>

#include <random>

#include "scene/datasets/mask_image.h"
#include "scene/lens/area_resample.h"
#include "scene/lens/photograph.h"

using namespace trisoup;
using namespace trisoup::scene;

namespace {

Photograph random_photograph(int width, int height, bool masked) {
  std::mt19937 random(7);
  Photograph photograph{width, height, {}, {}};
  for (std::size_t i = 0; i < photograph.pixels(); ++i) {
    photograph.colour.emplace_back(random() % 256, random() % 256, random() % 256, 255);
    if (masked) photograph.inside.push_back(random() % 2 ? 255 : 0);
  }
  return photograph;
}

double overlap(double a0, double a1, double b0, double b1) {
  return std::max(0.0, std::min(a1, b1) - std::max(a0, b0));
}

}  // namespace

TEST_CASE("area resampling weights pixels by covered area, for any factor", "[scene][resample]") {
  const bool masked = GENERATE(false, true);
  const auto [width, height] =
      GENERATE(std::pair(5, 3), std::pair(13, 9), std::pair(7, 9), std::pair(1, 1), std::pair(12, 8));
  const Photograph source = random_photograph(13, 9, masked);
  const Photograph target = area_resample(source, width, height);
  REQUIRE(target.width == width);
  REQUIRE(target.height == height);
  REQUIRE(target.colour.size() == target.pixels());
  REQUIRE(target.inside.size() == (masked ? target.pixels() : 0));
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      double sum = 0, weight = 0, all = 0, area = 0;
      for (int j = 0; j < 9; ++j)
        for (int i = 0; i < 13; ++i) {
          const double share = overlap(x * 13.0 / width, (x + 1) * 13.0 / width, i, i + 1) *
                               overlap(y * 9.0 / height, (y + 1) * 9.0 / height, j, j + 1);
          const std::size_t index = std::size_t(j * 13 + i);
          const bool inside = !masked || source.inside[index] != 0;
          sum += inside ? share * source.colour[index].r : 0;
          weight += inside ? share : 0;
          all += share * source.colour[index].r;
          area += share;
        }
      const std::size_t index = std::size_t(y * width + x);
      CHECK(std::abs(target.colour[index].r - (weight > 1e-9 ? sum / weight : all / area)) <= 0.501);
      if (masked && std::abs(weight / area - 0.5) > 1e-4) CHECK((target.inside[index] != 0) == (weight / area > 0.5));
    }
}

TEST_CASE("RGB of transparent pixels does not bleed into edges", "[scene][resample]") {
  // Left half opaque red, right half transparent with green, as in published files.
  Image image{4, 4, {}};
  for (int i = 0; i < 16; ++i)
    if (i % 4 < 1)
      image.rgba.insert(image.rgba.end(), {255, 0, 0, 255});
    else
      image.rgba.insert(image.rgba.end(), {0, 255, 0, 0});
  REQUIRE(alpha_of(image) == AlphaFound::some);
  const Photograph small = area_resample(from_coverage(image), 2, 2);
  CHECK(small.colour[0] == glm::u8vec4(128, 0, 0, 128));
  CHECK(small.colour[1] == glm::u8vec4(0, 0, 0, 0));
  const Image white = composite(small, 255);
  CHECK(std::vector<int>(white.rgba.begin(), white.rgba.begin() + 8) ==
        std::vector<int>{255, 127, 127, 128 + 64, 255, 255, 255, 128});
  CHECK(int(composite(small, 0).rgba[0]) == 128);
}

TEST_CASE("compositing without resampling is exact", "[scene][resample]") {
  for (int alpha = 0; alpha < 256; ++alpha) {
    const Image image{1, 1, {200, 13, 255, std::uint8_t(alpha)}};
    const Image result = composite(from_coverage(image), 255);
    for (std::size_t c = 0; c < 3; ++c)
      CHECK(int(result.rgba[c]) == int(image.rgba[c] * alpha / 255.0 + 255 - alpha + 0.5));
    CHECK(std::abs(result.rgba[3] - 128 - 127 * alpha / 255.0) <= 0.5);
    // Its photograph is the same picture again, and can be averaged.
    const Photograph again = from_view(result);
    CHECK((again.inside.empty() && composite(again, 0).rgba == result.rgba));
  }
  const Image excluded{2, 1, {1, 2, 3, 0, 4, 5, 6, 200}};
  CHECK(composite(from_view(excluded), 0).rgba == excluded.rgba);
}

TEST_CASE("alpha as a mask does not change RGB and has the threshold 0.5", "[scene][resample]") {
  const Image image{4, 1, {10, 20, 30, 0, 11, 21, 31, 127, 12, 22, 32, 128, 13, 23, 33, 255}};
  const Image result = composite(from_mask(image), 255);
  CHECK(result.rgba == std::vector<std::uint8_t>{10, 20, 30, 0, 11, 21, 31, 0, 12, 22, 32, 255, 13, 23, 33, 255});
  CHECK(from_mask({1, 1, {1, 2, 3, 255}}).inside.empty());
}

TEST_CASE("a mask of another size is sampled at the nearest pixel", "[scene][resample]") {
  Photograph photograph = random_photograph(4, 2, false);
  const Image mask{2, 1, {0, 0, 0, 255, 0, 1, 0, 255}};
  exclude(photograph, mask, 1);
  CHECK(photograph.inside == std::vector<std::uint8_t>{0, 0, 255, 255, 0, 0, 255, 255});
  exclude(photograph, mask, 128);
  CHECK(photograph.inside == std::vector<std::uint8_t>(8, 0));
}
