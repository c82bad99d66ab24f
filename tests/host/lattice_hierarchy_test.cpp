// Tests engine/format/lattice_hierarchy.cpp.
#include <catch2/catch.hpp>

#include <cstdlib>
#include <vector>

#include "common/host.h"
#include "format/lattice_hierarchy.h"
#include "soup/random.h"
#include "soup/texture_table.h"

using namespace trisoup;

namespace {

glm::ivec2 point(std::uint32_t sample) {
  std::uint32_t x, y;
  f32::lattice_point(sample, x, y);
  return {static_cast<int>(x), static_cast<int>(y)};
}

}  // namespace

TEST_CASE("the hierarchy has every sample once, after the two samples it lies between", "[refinement]") {
  for (std::uint32_t level = 0; level <= soup::kMaxLevel; ++level) {
    CAPTURE(level);
    std::vector<bool> seen(soup::samples_at(level), false);
    std::size_t samples = 0;
    for (const soup::Refinement& p : soup::refinement(level)) {
      REQUIRE(p.sample < seen.size());
      CHECK_FALSE(seen[p.sample]);
      if (samples > 0) CHECK((seen[p.a] && seen[p.b]));
      if (p.depth > 0) {
        CHECK(2 * point(p.sample) == point(p.a) + point(p.b));
        const glm::ivec2 apart = glm::abs(point(p.a) - point(p.b));
        CHECK(std::max(apart.x, apart.y) == 2 << (level - p.depth));
      }
      seen[p.sample] = true;
      ++samples;
    }
    CHECK(samples == seen.size());
  }
}

TEST_CASE("rounding changes textures little and keeps opacities on their side of 0.5", "[refinement]") {
  soup::Random random(5);
  std::vector<soup::TextureLevels> levels;
  for (std::uint32_t t = 0; t < 60; ++t) levels.push_back({t % 6, t % 6});
  std::vector<soup::TextureEntry> table = soup::make_texture_table(levels).entries;
  std::vector<std::uint8_t> values(std::size_t(table.back().lattice_offset + 561) * 8);
  for (std::uint8_t& value : values) value = static_cast<std::uint8_t>(random.bits());
  for (const soup::TextureEntry& row : table) values[row.lattice_offset * 8 + 7] &= 127;  // none is completely opaque
  for (std::uint32_t bits = 1; bits <= 8; ++bits) {
    CAPTURE(bits);
    const soup::TextureSteps steps = soup::texture_steps(bits);
    std::vector<std::uint8_t> rounded = values;
    soup::round_textures(rounded, table, steps);
    if (bits == 8) CHECK(rounded == values);
    int furthest[8] = {};
    for (std::size_t i = 0; i < values.size(); ++i) {
      furthest[i % 8] = std::max(furthest[i % 8], std::abs(rounded[i] - values[i]));
      if (i % 8 == 7) REQUIRE((rounded[i] >= 128) == (values[i] >= 128));
    }
    // Limits: the dead zone, and a whole step for opacities that would cross 0.5.
    for (int c = 0; c < 7; ++c) CHECK(10 * furthest[c] <= 6 * steps[static_cast<std::size_t>(c)]);
    CHECK(furthest[7] <= steps[7]);
  }
}

TEST_CASE("opaque textures get one opacity, others keep their edge, and rounding is idempotent", "[refinement]") {
  const std::vector<soup::TextureEntry> table = soup::make_texture_table(2, {3, 3}).entries;
  const std::size_t count = soup::samples_at(3);
  std::vector<std::uint8_t> values(2 * count * 8, 100);
  for (std::size_t s = 0; s < 2 * count; ++s) values[s * 8 + 7] = static_cast<std::uint8_t>(s % 2 ? 130 : 250);
  values[(count + 5) * 8 + 7] = 127;
  soup::round_textures(values, table, soup::texture_steps(6));
  for (std::size_t s = 0; s < count; ++s) {
    CHECK(values[s * 8 + 7] == values[7]);
    CHECK((values[(count + s) * 8 + 7] >= 128) == (s != 5));
  }
  CHECK(std::abs(values[7] - 190) <= 6);
  std::vector<std::uint8_t> again = values;
  soup::round_textures(again, table, soup::texture_steps(6));
  CHECK(again == values);
}

TEST_CASE("noise below the dead zone is removed from a linear texture", "[refinement]") {
  std::vector<soup::TextureEntry> table = soup::make_texture_table(1, {4, 4}).entries;
  std::vector<std::uint8_t> values(soup::samples_at(4) * 8), plain(values.size());
  for (std::uint32_t s = 0; s < soup::samples_at(4); ++s)
    for (std::size_t c = 0; c < 8; ++c) {
      plain[s * 8 + c] = static_cast<std::uint8_t>((c < 7 ? 128 : 64) +
                                                   4 * point(s).x);  // 64 from corner to corner; not completely opaque
      values[s * 8 + c] = static_cast<std::uint8_t>(plain[s * 8 + c] + (point(s).x % 16 != 0 && s % 2 ? 2 : 0));
    }
  soup::round_textures(values, table, {4, 4, 4, 4, 4, 4, 4, 4});
  CHECK(values == plain);
}
