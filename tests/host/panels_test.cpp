// Tests viewer/layout.h and viewer/thumbnails.h.
#include <catch2/catch.hpp>

#include "viewer/layout.h"
#include "viewer/thumbnails.h"

using namespace trisoup;
using namespace trisoup::viewer;

TEST_CASE("panels side by side fit into the window", "[panels]") {
  for (const auto& [width, height] : {std::pair(1280.0f, 800.0f), {800.0f, 600.0f}, {1920.0f, 1080.0f}})
    for (const float display : {1.0f, 1.5f, 2.0f, 3.0f})
      for (const int panels : {1, 2})
        for (const bool strip : {false, true}) {
          const float scale = panel_scale(display, width, height, panels, strip);
          CAPTURE(width, display, panels, strip, scale);
          CHECK(scale <= display);
          CHECK(static_cast<float>(panels) * kPanelWidth * scale <= width);
          CHECK(scale * (kPanelHeight + (strip ? kStripHeight : 0)) <= height);
        }
  // As large as the display asks for where there is room.
  CHECK(panel_scale(2, 1920, 1080, 2, false) == 2);
  CHECK(panel_scale(2, 1280, 800, 1, false) == 2);
  CHECK(panel_scale(2, 1280, 800, 2, false) == 1.875f);
  CHECK(panel_scale(1, 800, 600, 2, true) == 1);
  // Text stays readable in a tiny window.
  CHECK(panel_scale(2, 100, 50, 2, true) == 1);
  CHECK(panel_scale(0.75f, 100, 50, 2, true) == 0.75f);
  CHECK(panel_scale(9, 90000, 90000, 1, false) == 4);
}

TEST_CASE("a panel is inside the window, whatever size that had", "[panels]") {
  CHECK(inside_window(10, 300, 1280) == 10);
  CHECK(inside_window(700, 300, 1280) == 700);
  CHECK(inside_window(1200, 300, 1280) == 970);
  CHECK(inside_window(-290, 300, 1280) == 10);  // where a window of a few pixels has left it
  CHECK(inside_window(700, 300, 20) == 10);
}

TEST_CASE("the help covers no panel", "[panels]") {
  CHECK(beside_help(1280, 1, true).view);
  CHECK(beside_help(1280, 1, true).training);
  CHECK(beside_help(800, 1, true).view);
  CHECK(!beside_help(800, 1, true).training);
  CHECK(!beside_help(1280, 2, false).view);
  CHECK(!beside_help(1280, 1, false).training);
}

TEST_CASE("a thumbnail is the mean of the pixels, with the photograph's shape", "[panels]") {
  Image image{6, 4, {}};
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 6; ++x)
      image.rgba.insert(image.rgba.end(),
                        {static_cast<std::uint8_t>(40 * x), static_cast<std::uint8_t>(y < 2 ? 10 : 30),
                         static_cast<std::uint8_t>(y % 2 == 0 ? 100 : 200), 0});
  const Image small = thumbnail(image, 2);
  REQUIRE(small.width == 3);
  REQUIRE(small.height == 2);
  CHECK(small.rgba == std::vector<std::uint8_t>{20, 10, 150, 255, 100, 10, 150, 255, 180, 10, 150, 255,  //
                                                20, 30, 150, 255, 100, 30, 150, 255, 180, 30, 150, 255});
  const Image large = thumbnail(image, 50);
  CHECK(large.width == 6);
  CHECK(large.height == 4);
  const Image narrow = thumbnail(Image{1, 300, std::vector<std::uint8_t>(1200, 7)}, 10);
  CHECK(narrow.width == 1);
  CHECK(narrow.height == 10);
}
