// Tests engine/soup/pieces.cpp.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <set>
#include <vector>

#include "mesh/triangle_distance.h"
#include "soup/pieces.h"
#include "soup/random.h"

using namespace trisoup;
using Vertices = std::vector<glm::vec3>;

namespace {

/// Adds the parallelogram corner, corner + u, corner + v as two triangles.
void add_square(Vertices& soup, glm::vec3 corner, glm::vec3 u, glm::vec3 v) {
  soup.insert(soup.end(), {corner, corner + u, corner + v, corner + u + v, corner + v, corner + u});
}

/// Adds the 12 triangles of a cube with edges of length 1.
void add_cube(Vertices& soup, glm::vec3 corner) {
  const glm::vec3 x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);
  for (const glm::vec3 offset : {glm::vec3(0), glm::vec3(1)}) {
    add_square(soup, corner + offset * z, x, y);
    add_square(soup, corner + offset * x, y, z);
    add_square(soup, corner + offset * y, x, z);
  }
}

std::vector<std::size_t> sizes(const std::vector<soup::Piece>& pieces) {
  std::vector<std::size_t> result;
  for (const soup::Piece& piece : pieces) result.push_back(piece.triangles.size());
  return result;
}

}  // namespace

TEST_CASE("two cubes apart are two pieces, and one at a gap that spans them") {
  Vertices cubes;
  add_cube(cubes, {0, 0, 0});
  add_cube(cubes, {1.5f, 0, 0});
  const auto apart = soup::pieces(cubes, 0.05);
  REQUIRE(sizes(apart) == std::vector<std::size_t>{12, 12});
  CHECK(apart[0].area == Approx(6));
  CHECK(apart[0].triangles.front() == 0);
  CHECK(apart[1].triangles.front() == 12);
  // The longest edge of their triangles is a diagonal.
  CHECK(soup::pieces(cubes, 0.51 / std::sqrt(2.0)).size() == 1);
  CHECK(soup::pieces(cubes, 0.49 / std::sqrt(2.0)).size() == 2);
}

TEST_CASE("sheets that nearly touch are one piece at a gap, two at none") {
  Vertices sheets;
  add_square(sheets, {0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  add_square(sheets, {1.02f, 0, 0}, {1, 0, 0}, {0, 1, 0});
  CHECK(soup::pieces(sheets, 0.05).size() == 1);
  CHECK(soup::pieces(sheets, 0).size() == 2);
}

TEST_CASE("a small sheet along the edge of a large one belongs to it, without a common corner") {
  Vertices sheets;
  add_square(sheets, {0, 0, 0}, {10, 0, 0}, {0, 10, 0});
  add_square(sheets, {10, 4.3f, 0}, {0.2f, 0, 0}, {0, 0.2f, 0});
  CHECK(sizes(soup::pieces(sheets, 0.01)) == std::vector<std::size_t>{4});
}

TEST_CASE("a box through a sheet is one piece with it") {
  Vertices soup;
  add_square(soup, {-5, -5, 0.4f}, {20, 0, 0}, {0, 20, 0});
  add_cube(soup, {0, 0, 0});
  CHECK(soup::pieces(soup, 0).size() == 1);
}

TEST_CASE("a speck near a large sheet stays a piece: the smaller triangle is the unit of the gap") {
  Vertices soup;
  add_square(soup, {0, 0, 0}, {100, 0, 0}, {0, 100, 0});
  add_square(soup, {50, 50, 1}, {0.1f, 0, 0}, {0, 0.1f, 0});
  CHECK(soup::pieces(soup, 0.1).size() == 2);
}

TEST_CASE("pieces are sorted by triangles, then by area") {
  Vertices soup;
  add_square(soup, {0, 0, 50}, {10, 0, 0}, {0, 10, 0});
  add_cube(soup, {0, 0, 0});
  add_square(soup, {0, 0, 90}, {20, 0, 0}, {0, 20, 0});
  const auto found = soup::pieces(soup, 0.05);
  REQUIRE(sizes(found) == std::vector<std::size_t>{12, 2, 2});
  CHECK(found[1].area == Approx(400));
  CHECK(found[2].area == Approx(100));
  CHECK(soup::pieces({}, 0.05).empty());
}

TEST_CASE("the tree finds the pieces that comparing all pairs finds") {
  soup::Random random(3);
  Vertices soup;
  const std::size_t count = 500;
  for (std::size_t t = 0; t < count; ++t) {
    const glm::vec3 at(random.uniform01(), random.uniform01(), random.uniform01());
    const float size = t % 50 == 0 ? 0.6f : 0.2f;
    for (int k = 0; k < 3; ++k)
      soup.push_back(at + size * glm::vec3(random.uniform01(), random.uniform01(), random.uniform01()));
  }
  const auto corners = [&](std::size_t t) {
    return soup::Corners3{glm::dvec3(soup[3 * t]), glm::dvec3(soup[3 * t + 1]), glm::dvec3(soup[3 * t + 2])};
  };
  const auto longest = [&](std::size_t t) {
    const auto c = corners(t);
    return std::max({glm::distance(c[0], c[1]), glm::distance(c[1], c[2]), glm::distance(c[2], c[0])});
  };
  std::vector<std::size_t> label(count);
  for (std::size_t t = 0; t < count; ++t) label[t] = t;
  for (std::size_t a = 0; a < count; ++a)
    for (std::size_t b = 0; b < a; ++b) {
      if (label[a] == label[b] || soup::distance(corners(a), corners(b)) > 0.1 * std::min(longest(a), longest(b)))
        continue;
      const std::size_t from = label[a], to = label[b];
      for (std::size_t& l : label)
        if (l == from) l = to;
    }
  const auto found = soup::pieces(soup, 0.1);
  CHECK(found.size() == std::set(label.begin(), label.end()).size());
  CHECK(found.size() > 20);
  CHECK(found[0].triangles.size() > 10);
  for (const soup::Piece& piece : found)
    for (const std::uint32_t t : piece.triangles) CHECK(label[t] == label[piece.triangles[0]]);
}
