// Tests engine/image/palette.h.
#include <catch2/catch.hpp>

#include <cstdlib>
#include <functional>

#include "image/palette.h"
#include "soup/random.h"

using namespace trisoup;

namespace {

Image image_of(int width, int height, const std::function<glm::ivec4(int)>& pixel) {
  Image image{width, height, {}};
  for (int i = 0; i < width * height; ++i)
    for (int c = 0; c < 4; ++c) image.rgba.push_back(static_cast<std::uint8_t>(pixel(i)[c]));
  return image;
}

}  // namespace

TEST_CASE("an image of few colours keeps them to the size of a colour cell", "[palette]") {
  for (int colours : {1, 2, 3, 200}) {
    CAPTURE(colours);
    soup::Random random(static_cast<std::uint64_t>(colours));
    std::vector<glm::ivec4> chosen;
    for (int i = 0; i < colours; ++i)
      chosen.emplace_back(int(random.uniform01() * 255), int(random.uniform01() * 255), int(random.uniform01() * 255),
                          i % 3 == 2 ? 0 : 255);
    const Image image = image_of(40, 30, [&](int i) { return chosen[static_cast<std::size_t>(i) % chosen.size()]; });
    const PaletteImage palette = make_palette(image, std::vector<bool>(1200, true));
    int worst = 0;
    for (std::size_t i = 0; i < 1200; ++i)
      for (int c = 0; c < 4; ++c) {
        const int is = palette.colours[palette.pixels[i]][c], was = image.rgba[4 * i + static_cast<std::size_t>(c)];
        if (c < 3 && image.rgba[4 * i + 3] < 128 && colours > 90)
          continue;  // more than 32 invisible colours share entries
        worst = std::max(worst, std::abs(is - was));
      }
    CHECK(worst <= 3);
  }
}

TEST_CASE("the colour of a cell is its rounded mean", "[palette]") {
  // 5, 6 and 6 share a cell; their mean is 5.67.
  const Image image = image_of(3, 1, [](int i) { return glm::ivec4(glm::ivec3(i == 0 ? 5 : 6), 255); });
  const PaletteImage palette = make_palette(image, {true, true, true});
  REQUIRE(palette.colours.size() == 1);
  CHECK(palette.colours[0] == glm::u8vec4(6, 6, 6, 255));
  CHECK(make_palette(image, {false, false, false}).colours.size() == 1);
}
