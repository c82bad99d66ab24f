// Tests engine/soup/crop.cpp and engine/soup/selection.cpp.
#include <catch2/catch.hpp>

#include <array>
#include <cstdint>
#include <vector>

#include "soup/crop.h"
#include "soup/selection.h"

using namespace trisoup;
using soup::Across;
using Triangle = std::array<glm::dvec3, 3>;

namespace {

constexpr std::array<Across, 3> kAll{Across::keep, Across::centroid, Across::drop};

/// Whether keep, centroid and drop hold the triangle.
std::array<bool, 3> held(const soup::CropRegion& region, const Triangle& triangle) {
  std::array<bool, 3> result{};
  for (std::size_t i = 0; i < 3; ++i) result[i] = soup::holds(region, triangle, kAll[i]);
  return result;
}

using Held = std::array<bool, 3>;

/// A model of triangles of levels 0, 2 and 1 whose samples hold their number in the lattice.
soup::Model three_triangles() {
  soup::Model model;
  model.background = glm::vec3(0.25f);
  model.origin = {10, 20, 30};
  std::uint8_t value = 0;
  for (const std::uint32_t level : {0u, 2u, 1u}) {
    soup::TextureEntry row;
    row.level_max = level;
    row.lattice_offset = static_cast<std::uint32_t>(model.lattice.size() / soup::kChannels);
    for (int k = 0; k < 3; ++k) model.vertices.emplace_back(level, k, 0);
    model.textures.push_back(row);
    for (std::uint32_t s = 0; s < soup::samples_at(level); ++s, ++value)
      model.lattice.insert(model.lattice.end(), soup::kChannels, value);
  }
  return model;
}

}  // namespace

TEST_CASE("a box holds triangles inside, none outside, and some across its border") {
  const soup::CropRegion region{{{{-1, -1, -1}, {1, 1, 1}}}, {}};
  CHECK(held(region, {glm::dvec3(0, 0, 0), {1, 0, 0}, {0, 1, 0}}) == Held{true, true, true});
  CHECK(held(region, {glm::dvec3(2, 0, 0), {3, 0, 0}, {2, 1, 0}}) == Held{false, false, false});
  CHECK(held(region, {glm::dvec3(0, 0, 0), {2, 0, 0}, {0, 0.5, 0}}) == Held{true, true, false});
  CHECK(held(region, {glm::dvec3(0, 0, 0), {9, 0, 0}, {9, 1, 0}}) == Held{true, false, false});
  // All corners outside: through the middle, and around the box without touching it.
  CHECK(held(region, {glm::dvec3(-9, 0, 0), {9, 0.1, 0}, {9, -0.1, 0.5}}) == Held{true, false, false});
  CHECK(held(region, {glm::dvec3(2.5, 0, 0), {0, 2.5, 0}, {2.5, 2.5, 0}}) == Held{false, false, false});
}

TEST_CASE("a sphere holds triangles inside, none outside, and some across its border") {
  const soup::CropRegion region{{}, {{{10, 0, 0}, 1}}};
  CHECK(held(region, {glm::dvec3(10, 0, 0), {10.9, 0, 0}, {10, 0.9, 0}}) == Held{true, true, true});
  CHECK(held(region, {glm::dvec3(10.8, 0.8, 0), {12, 0, 0}, {12, 1, 0}}) == Held{false, false, false});
  CHECK(held(region, {glm::dvec3(10, 0, 0), {11.5, 0, 0}, {10, 0.5, 0}}) == Held{true, true, false});
  CHECK(held(region, {glm::dvec3(0, -9, 0), {30, -9, 0.2}, {10, 30, 0.1}}) == Held{true, false, false});
}

TEST_CASE("several regions hold what any of them holds") {
  const soup::CropRegion region{{{{-1, -1, -1}, {1, 1, 1}}, {{4, 4, 4}, {5, 5, 5}}}, {{{10, 0, 0}, 1}}};
  for (const glm::dvec3 at : {glm::dvec3(0), glm::dvec3(4.5), glm::dvec3(10, 0.5, 0)})
    CHECK(held(region, {at, at + glm::dvec3(0.1, 0, 0), at + glm::dvec3(0, 0.1, 0)}) == Held{true, true, true});
  CHECK(held(region, {glm::dvec3(7, 0, 0), {7.1, 0, 0}, {7, 0.1, 0}}) == Held{false, false, false});
  CHECK(held({}, {glm::dvec3(0), {1, 0, 0}, {0, 1, 0}}) == Held{false, false, false});
}

TEST_CASE("a selection has the vertices and textures of its triangles and everything else of the model") {
  const soup::Model model = three_triangles();
  const std::vector<std::uint32_t> kept{1, 2};
  const soup::Model part = soup::selected(model, kept);
  REQUIRE(part.triangles() == 2);
  CHECK(part.vertices == std::vector<glm::vec3>(model.vertices.begin() + 3, model.vertices.end()));
  CHECK(part.background == model.background);
  CHECK(part.origin == model.origin);
  CHECK(part.lattice.size() == (15 + 6) * soup::kChannels);
  CHECK(part.textures[0].lattice_offset == 0);
  CHECK(part.textures[1].lattice_offset == 15);
  CHECK(part.lattice.front() == 3);
  CHECK(part.lattice[15 * soup::kChannels] == 3 + 15);
}

TEST_CASE("mean colours are those of drawn samples, or of all if none is drawn") {
  soup::Model model = three_triangles();
  std::vector<std::uint8_t> baked(model.lattice.size() / soup::kChannels * 3, 255);
  for (std::size_t s = 0; s < baked.size() / 3; ++s) model.lattice[s * soup::kChannels + 7] = 0;
  baked[0] = baked[1] = baked[2] = 0;  // one of three samples of triangle 0, none of which is drawn
  const std::size_t last = baked.size() / 3 - 1;
  model.lattice[last * soup::kChannels + 7] = 128;  // the only drawn sample of triangle 2
  baked[3 * last] = baked[3 * last + 2] = 51;
  const auto colours = soup::mean_colours(model, baked);
  REQUIRE(colours.size() == 3);
  CHECK(colours[0].r == Approx(2.0 / 3));
  CHECK(colours[1].g == Approx(1));
  CHECK(colours[2].r == Approx(0.2));
  CHECK(colours[2].g == Approx(1));
}
