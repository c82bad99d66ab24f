// Tests engine/soup/texture_table.h.
#include <catch2/catch.hpp>

#include "base/error.h"
#include "soup/texture_table.h"

using namespace trisoup;
using namespace trisoup::soup;

TEST_CASE("textures are stored one after the other, with sizes by level", "[texture_table]") {
  const std::vector<TextureLevels> levels{{0, 0}, {2, 5}, {3, 3}, {0, 1}};
  const TextureTable table = make_texture_table(levels);
  REQUIRE(table.triangles() == 4);
  const std::uint32_t source[] = {0, 3, 777, 822}, lattice[] = {0, 3, 564, 609};
  for (std::size_t t = 0; t < 4; ++t) {
    CHECK(table.entries[t].source_offset == source[t]);
    CHECK(table.entries[t].lattice_offset == lattice[t]);
    CHECK(table.entries[t].level_min == levels[t].level_min);
    CHECK(table.entries[t].level_max == levels[t].level_max);
  }
  CHECK(table.source_samples == 831);
  CHECK(table.lattice_samples == 615);
}

TEST_CASE("equal levels for all triangles", "[texture_table]") {
  const TextureTable table = make_texture_table(15'000, TextureLevels{2, 5});
  CHECK(table.source_samples == 15'000u * 774u);
  CHECK(table.lattice_samples == 15'000u * 561u);
  CHECK(table.entries[14'999].source_offset == 14'999u * 774u);
  CHECK(make_texture_table(0, TextureLevels{0, 0}).source_samples == 0);
}

TEST_CASE("a texture gets the coarsest sufficient level within its range", "[texture_table]") {
  const TextureLevels all{2, 5};
  CHECK(as_fine_as(0, all) == TextureLevels{2, 2});
  CHECK(as_fine_as(8, all) == TextureLevels{2, 2});
  CHECK(as_fine_as(8.01, all) == TextureLevels{2, 3});
  CHECK(as_fine_as(32, all) == TextureLevels{2, 3});
  CHECK(as_fine_as(33, all) == TextureLevels{2, 4});
  CHECK(as_fine_as(1e12, all) == TextureLevels{2, 5});
  CHECK(as_fine_as(1e12, {3, 3}) == TextureLevels{3, 3});
  CHECK(as_fine_as(1, {0, 5}) == TextureLevels{0, 1});
}

TEST_CASE("invalid levels and overflowing offsets are errors", "[texture_table]") {
  CHECK_THROWS_AS(make_texture_table(1, TextureLevels{3, 2}), Error);
  CHECK_THROWS_AS(make_texture_table(1, TextureLevels{0, kMaxLevel + 1}), Error);
  CHECK_THROWS_AS(make_texture_table(1, TextureLevels{~0u, ~0u}), Error);
  // The largest possible number of the largest textures, and one more.
  const std::size_t fits = (1u << 28) / samples_at(kMaxLevel);
  CHECK(make_texture_table(fits, TextureLevels{kMaxLevel, kMaxLevel}).source_samples == fits * samples_at(kMaxLevel));
  CHECK_THROWS_AS(make_texture_table(fits + 1, TextureLevels{kMaxLevel, kMaxLevel}), Error);
}
