// Tests train/quality/removed_masks.h: what becomes of the pixels that show removed triangles.
#include "train/quality/removed_masks.h"

#include <algorithm>

#include <catch2/catch.hpp>

#include "board_scene.h"
#include "small_scene.h"
#include "train/quality/evaluate.h"

using namespace trisoup;

namespace {

/// Opaque rectangles of two triangles each: x0, y0, x1, y1, z.
soup::Model rectangles(gpu::Device& gpu, const std::vector<std::array<float, 5>>& rows) {
  test::SmallScene s(gpu, static_cast<std::uint32_t>(2 * rows.size()), {{0, 0}}, {test::view_from(0, 16, 16)});
  soup::Model model = train::make_model(gpu, s.soup, glm::vec3(0.0f), {});
  model.vertices.clear();
  for (const auto& [x0, y0, x1, y1, z] : rows)
    model.vertices.insert(model.vertices.end(),
                          {{x0, y0, z}, {x1, y0, z}, {x1, y1, z}, {x0, y0, z}, {x1, y1, z}, {x0, y1, z}});
  std::fill(model.lattice.begin(), model.lattice.end(), std::uint8_t{255});
  return model;
}

}  // namespace

TEST_CASE("removed triangles are masked out, and background where nothing is behind them", "[removed_masks]") {
  const auto gpu = test::open_device();
  scene::Scene scene;
  scene.train = test::photographs(1);  // 96 x 64, at (-0.16, -0.08, -1), looking along z
  scene.test = test::photographs(1);
  scene.background = glm::vec3(0.2f, 0.4f, 1.0f);
  // A removed rectangle of 45 x 27 pixels from column 29 and row 15 on, its right part before another.
  const auto at = [](double column, double row, double z) {
    return std::pair(static_cast<float>((column - 47) / 90 * (z + 1) - 0.16),
                     static_cast<float>((row - 33) / 90 * (z + 1) - 0.08));
  };
  const auto [x0, y0] = at(29, 15, 0);
  const auto [x1, y1] = at(74, 42, 0);
  const auto [x2, y2] = at(60, 5, 1);
  const auto [x3, y3] = at(90, 60, 1);
  const std::array<float, 5> front{x0, y0, x1, y1, 0}, behind{x2, y2, x3, y3, 1};
  const soup::Model original = rectangles(*gpu, {front, behind}), cleaned = rectangles(*gpu, {behind});
  train::Settings settings;
  settings.near = settings.test_near = 0.1;
  settings.far = 10;
  const train::RemovedShares shares =
      train::mask_removed(*gpu, scene, original, {true, true, false, false}, cleaned, settings);
  // With a margin of 2 pixels on each side.
  CHECK(shares.train == Approx(49.0 * 31 / (96 * 64)));
  CHECK(shares.test == Approx(49.0 * 31 / (96 * 64)));
  const Image whole = test::photographs(1)[0].image;
  int wrong = 0, emptied = 0;
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 96; ++x) {
      const std::size_t i = 4 * (96 * std::size_t(y) + std::size_t(x));
      const bool masked = x >= 27 && x < 76 && y >= 13 && y < 44, empty = x >= 31 && x < 58 && y >= 17 && y < 40;
      const auto *train = &scene.train[0].image.rgba[i], *test = &scene.test[0].image.rgba[i];
      wrong += test[3] != (masked ? 0 : 255);
      wrong += train[3] != (empty ? 128 : masked ? 0 : 255);
      wrong += !masked && !std::equal(train, train + 3, &whole.rgba[i]);
      emptied += empty && train[0] == 51 && train[1] == 102 && train[2] == 255;
    }
  CHECK(wrong == 0);
  CHECK(emptied == 27 * 23);
  REQUIRE(scene.whole);
  CHECK(scene.whole->test == scene::fingerprint_of_photographs(test::photographs(1)));
  CHECK(scene.whole->train != scene.whole->test);
  test::require_silence(*gpu);
}
