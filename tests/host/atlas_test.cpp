// Tests engine/soup/atlas.cpp.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include "base/error.h"
#include "soup/atlas.h"
#include "soup/random.h"

using namespace trisoup;
using Catch::Matchers::Contains;

TEST_CASE("no two lattices or gutters of an atlas share a texel", "[atlas]") {
  soup::Random random(3);
  std::vector<std::uint32_t> levels;
  for (int t = 0; t < 333; ++t) levels.push_back(random.bits() % (soup::kMaxAtlasLevel + 1));
  const bool many_pages = GENERATE(false, true);
  const soup::Atlas atlas = many_pages ? soup::make_atlas(levels, soup::kMinAtlasSide) : soup::make_atlas(levels);
  REQUIRE((atlas.pages.size() > 1) == many_pages);
  for (const glm::ivec2& page : atlas.pages)
    REQUIRE(std::max(page.x, page.y) <= (many_pages ? soup::kMinAtlasSide : soup::kAtlasSide));
  std::set<std::tuple<int, int, int>> taken;
  std::size_t texels = 0;
  for (const soup::AtlasPlace& place : atlas.places) {
    const auto take = [&](int x, int y) {
      const glm::ivec2 texel = soup::atlas_texel(place, x, y);
      REQUIRE(texel.x >= 0);
      REQUIRE(texel.y >= 0);
      REQUIRE(texel.x < atlas.pages[place.page].x);
      REQUIRE(texel.y < atlas.pages[place.page].y);
      taken.insert({place.page, texel.x, texel.y});
      ++texels;
    };
    const int r = 1 << place.level;
    for (int y = 0; y <= r; ++y)
      for (int x = 0; x + y <= r; ++x) take(x, y);
    soup::each_gutter_texel(place.level, [&](const soup::GutterTexel& gutter) { take(gutter.at.x, gutter.at.y); });
  }
  CHECK(taken.size() == texels);
}

TEST_CASE("bilinear sampling inside a triangle reads only its own texels and gutter", "[atlas]") {
  const std::vector<std::uint32_t> levels{5, 5, 3, 3, 0, 0, 2, 1, 8, 7, 6, 4};
  const soup::Atlas atlas = soup::make_atlas(levels);
  soup::Random random(5);
  for (const soup::AtlasPlace& place : atlas.places) {
    glm::vec2 uv[3];
    soup::atlas_uv(place, atlas.pages[place.page], uv);
    const int r = 1 << place.level;
    std::set<std::pair<int, int>> own;
    const auto add = [&](int x, int y) {
      const glm::ivec2 t = soup::atlas_texel(place, x, y);
      own.insert({t.x, t.y});
    };
    for (int y = 0; y <= r; ++y)
      for (int x = 0; x + y <= r; ++x) add(x, y);
    soup::each_gutter_texel(place.level, [&](const soup::GutterTexel& gutter) { add(gutter.at.x, gutter.at.y); });
    for (int i = 0; i < 500; ++i) {
      double b0 = random.uniform01(), b1 = random.uniform01();
      if (b0 + b1 > 1) b0 = 1 - b0, b1 = 1 - b1;
      const glm::dvec2 at = b0 * glm::dvec2(uv[0]) + b1 * glm::dvec2(uv[1]) + (1 - b0 - b1) * glm::dvec2(uv[2]);
      const glm::dvec2 texel = at * glm::dvec2(atlas.pages[place.page]) - 0.5;
      for (int dy = 0; dy < 2; ++dy)
        for (int dx = 0; dx < 2; ++dx) {
          const double fx = texel.x - std::floor(texel.x), fy = texel.y - std::floor(texel.y);
          const double weight = (dx ? fx : 1 - fx) * (dy ? fy : 1 - fy);
          if (weight < 1e-3) continue;  // rounding errors of the coordinates
          CHECK(own.contains({int(std::floor(texel.x)) + dx, int(std::floor(texel.y)) + dy}));
        }
    }
    // Lattice points are texel centres.
    const glm::dvec2 corner = glm::dvec2(uv[0]) * glm::dvec2(atlas.pages[place.page]) - 0.5;
    const glm::ivec2 expected = soup::atlas_texel(place, r, 0);
    CHECK(corner.x == Approx(expected.x).margin(1e-3));
    CHECK(corner.y == Approx(expected.y).margin(1e-3));
  }
}

TEST_CASE("an atlas wastes little space", "[atlas]") {
  const std::vector<std::uint32_t> levels(2000, 5);
  const soup::Atlas atlas = soup::make_atlas(levels);
  REQUIRE(atlas.pages.size() == 1);
  CHECK(double(atlas.pages[0].x) * atlas.pages[0].y < 1.15 * 2000 * soup::samples_at(5));
}

TEST_CASE("a gutter texel is extrapolated from lattice points of the last cell", "[atlas]") {
  for (std::uint32_t level = 0; level <= soup::kMaxAtlasLevel; ++level) {
    const int r = 1 << level;
    int count = 0;
    soup::each_gutter_texel(level, [&](const soup::GutterTexel& gutter) {
      ++count;
      CHECK(gutter.at.x + gutter.at.y == r + 1);
      for (const glm::ivec2& p : {gutter.a, gutter.b, gutter.c}) CHECK((p.x >= 0 && p.y >= 0 && p.x + p.y <= r));
      if (gutter.at.x > 0 && gutter.at.y > 0)
        CHECK(gutter.a + gutter.b - gutter.c == gutter.at);  // exact for linear textures
    });
    CHECK(count == r + 2);
  }
}

TEST_CASE("an invalid atlas is refused", "[atlas]") {
  CHECK_THROWS_WITH(soup::make_atlas(std::vector<std::uint32_t>{9}), Contains("level 9"));
  CHECK_THROWS_WITH(soup::make_atlas(std::vector<std::uint32_t>{1}, 100), Contains("100 texels"));
  CHECK_THROWS_WITH(soup::make_atlas(std::vector<std::uint32_t>{1}, 1 << 20), Contains("atlas side"));
  // Two triangles of level 8 share a block, and a page of 512 x 512 texels has room for one block.
  CHECK_THROWS_WITH(soup::make_atlas(std::vector<std::uint32_t>(514, 8), soup::kMinAtlasSide),
                    Contains("256 atlas pages"));
  CHECK(soup::make_atlas(std::vector<std::uint32_t>(512, 8), soup::kMinAtlasSide).pages.size() == 256);
  CHECK(soup::make_atlas({}).pages.size() == 1);
}

TEST_CASE("lattices of mixed levels do not overlap in any order", "[atlas]") {
  const std::uint64_t seed = GENERATE(range(0, 20));
  soup::Random random(seed);
  std::vector<std::uint32_t> levels;
  for (std::uint32_t t = 0, count = 1 + random.below(200); t < count; ++t)
    levels.push_back(random.below(soup::kMaxLevel + 1));
  const soup::Atlas atlas = soup::make_atlas(levels);
  REQUIRE(atlas.places.size() == levels.size());
  std::vector<std::vector<int>> owners;
  for (const glm::ivec2& page : atlas.pages) owners.emplace_back(std::size_t(page.x) * page.y, -1);
  int shared = 0;
  for (std::size_t t = 0; t < levels.size(); ++t) {
    const soup::AtlasPlace& place = atlas.places[t];
    REQUIRE(place.level == levels[t]);
    const int r = 1 << place.level;
    for (int y = 0; y <= r + 1; ++y)
      for (int x = 0; x + y <= r + 1; ++x) {
        const glm::ivec2 texel = soup::atlas_texel(place, x, y);
        int& owner = owners[place.page].at(std::size_t(texel.y) * atlas.pages[place.page].x + texel.x);
        shared += owner >= 0;
        owner = static_cast<int>(t);
      }
  }
  CHECK(shared == 0);
}

TEST_CASE("interpolated texture coordinates give the lattice point of the same barycentrics", "[atlas]") {
  const std::vector<std::uint32_t> levels{5, 0, 3, 5, 1, 4, 2, 0, 3};
  const soup::Atlas atlas = soup::make_atlas(levels);
  soup::Random random(9);
  for (const soup::AtlasPlace& place : atlas.places) {
    glm::vec2 uv[3];
    soup::atlas_uv(place, atlas.pages[place.page], uv);
    const int r = 1 << place.level;
    for (int i = 0; i < 200; ++i) {
      float b0 = random.uniform01(), b1 = random.uniform01();
      if (b0 + b1 > 1) b0 = 1 - b0, b1 = 1 - b1;
      const glm::vec2 at =
          (b0 * uv[0] + b1 * uv[1] + (1 - b0 - b1) * uv[2]) * glm::vec2(atlas.pages[place.page]) - 0.5f;
      const glm::vec2 point = float(r) * glm::vec2(b0, b1);  // lattice units: texels, possibly turned
      const glm::vec2 origin = glm::vec2(soup::atlas_texel(place, 0, 0));
      const glm::vec2 expected = place.turned ? origin - point : origin + point;
      CHECK(glm::length(at - expected) < 2e-3f);
    }
  }
}

TEST_CASE("the weights of an atlas are those of bilinear sampling", "[atlas]") {
  const std::vector<std::uint32_t> levels{0, 1, 2, 3, 5, 5};
  const soup::Atlas atlas = soup::make_atlas(levels);
  const glm::ivec2 size = atlas.pages[0];
  soup::Random random(6);
  std::vector<float> image(std::size_t(size.x) * std::size_t(size.y));
  for (const soup::AtlasPlace& place : atlas.places) {
    const auto texel = [&](int x, int y) -> float& {
      const glm::ivec2 t = soup::atlas_texel(place, x, y);
      return image[std::size_t(t.y) * std::size_t(size.x) + std::size_t(t.x)];
    };
    std::vector<glm::vec3> values(soup::samples_at(place.level));
    soup::each_lattice_point(place.level, [&](int x, int y, std::uint32_t index) {
      values[index] = glm::vec3(random.uniform01());
      texel(x, y) = values[index].x;
    });
    soup::each_gutter_texel(place.level, [&](const soup::GutterTexel& g) {
      texel(g.at.x, g.at.y) = texel(g.a.x, g.a.y) + texel(g.b.x, g.b.y) - texel(g.c.x, g.c.y);
    });
    glm::vec2 uv[3];
    soup::atlas_uv(place, size, uv);
    for (int i = 0; i < 200; ++i) {
      float b0 = random.uniform01(), b1 = random.uniform01();
      if (b0 + b1 > 1) b0 = 1 - b0, b1 = 1 - b1;
      const glm::vec2 at = (b0 * uv[0] + b1 * uv[1] + (1 - b0 - b1) * uv[2]) * glm::vec2(size) - 0.5f,
                      low = glm::floor(at), f = at - low;
      const auto value = [&](int dx, int dy) {
        const int x = std::min(int(low.x) + dx, size.x - 1), y = std::min(int(low.y) + dy, size.y - 1);
        return image[std::size_t(y) * std::size_t(size.x) + std::size_t(x)];
      };
      const float expected = (1 - f.y) * ((1 - f.x) * value(0, 0) + f.x * value(1, 0)) +
                             f.y * ((1 - f.x) * value(0, 1) + f.x * value(1, 1));
      const soup::AtlasWeights weights(b0, b1, place.level);
      CHECK(weights.weight[0] + weights.weight[1] + weights.weight[2] + weights.weight[3] == Approx(1));
      CHECK(weights.mix(values.data()).x == Approx(expected).margin(2e-3));
    }
  }
}
