// Tests engine/format/vertex_code.cpp and vertex_grid.cpp.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

#include <glm/gtc/matrix_transform.hpp>

#include "base/error.h"
#include "format/vertex_code.h"
#include "format/vertex_grid.h"
#include "soup/random.h"
#include "soup/texture_table.h"

using namespace trisoup;
using Catch::Matchers::Contains;

namespace {

/// Triangles in a row with sides of about `side` grid steps.
std::vector<soup::GridTriangle> sheet(std::size_t triangles, std::uint32_t side, std::uint64_t seed) {
  soup::Random random(seed);
  std::vector<soup::GridTriangle> all;
  for (std::size_t t = 0; t < triangles; ++t) {
    const glm::ivec3 corner(int(side * t), int(random.below(side)), int(random.below(side / 4)));
    const auto away = [&] {
      return glm::ivec3(int(random.below(2 * side)) - int(side), int(random.below(2 * side)) - int(side),
                        int(random.below(side / 4)));
    };
    all.push_back({12, {corner, corner + away(), corner + away()}});
  }
  return all;
}

bool same(std::span<const soup::GridTriangle> a, std::span<const soup::GridTriangle> b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const auto& x, const auto& y) { return x.exponent == y.exponent && x.corners == y.corners; });
}

bool come_back(std::span<const soup::GridTriangle> triangles) {
  return same(triangles, soup::decode_vertices(soup::encode_vertices(triangles), triangles.size(), "x"));
}

soup::ModelCamera camera_at(const glm::dvec3& place, double focal) {
  soup::ModelCamera c{"a", false, {}};
  c.camera.width = c.camera.height = 100;
  c.camera.fx = c.camera.fy = focal;
  c.camera.cx = c.camera.cy = 50;
  c.camera.world_to_camera = glm::translate(glm::dmat4(1), -place);
  return c;
}

/// Triangles of level 0 with random corners in a box around (0, 0, 3).
soup::Model ball_of(std::size_t triangles) {
  soup::Random random(5);
  soup::Model model;
  for (std::size_t i = 0; i < 3 * triangles; ++i)
    model.vertices.emplace_back(random.uniform01() - 0.5, random.uniform01() - 0.5, 2.5 + random.uniform01());
  model.textures = soup::make_texture_table(std::vector<soup::TextureLevels>(triangles, {0, 0})).entries;
  return model;
}

}  // namespace

TEST_CASE("vertices on a grid are decoded unchanged", "[vertex_code]") {
  CHECK(come_back(sheet(500, 80, 1)));
  CHECK(come_back({}));
  // Any values within the limits, on unrelated grids.
  soup::Random random(2);
  std::vector<soup::GridTriangle> wild;
  for (int t = 0; t < 300; ++t) {
    soup::GridTriangle& triangle = wild.emplace_back();
    triangle.exponent = int(random.below(2 * soup::kMostExponent + 1)) - soup::kMostExponent;
    for (auto& corner : triangle.corners)
      for (int axis = 0; axis < 3; ++axis)
        corner[axis] = t % 3 == 0 ? (random.below(2) ? soup::kMostSteps : -soup::kMostSteps)
                                  : int(random.bits() >> (8 + random.below(24))) * (random.below(2) ? 1 : -1);
  }
  CHECK(come_back(wild));
}

TEST_CASE("the size of coded vertices follows from the length of their sides", "[vertex_code]") {
  // Per triangle: five numbers with range 2 side, one with range side, three with range side / 4 or less. Relative to
  // the centre of the triangle before, some ranges double.
  const auto triangles = sheet(2000, 128, 3);
  const double bits = 8.0 * double(soup::encode_vertices(triangles).size()) / 2000;
  CHECK(bits > 4 * 8 + 7 + 2 * 5);
  CHECK(bits < 6 * 8 + 3 * 7 + 3);
}

TEST_CASE("vertices beyond the grid and damaged bytes are refused", "[vertex_code]") {
  auto triangles = sheet(50, 80, 4);
  const std::vector<std::byte> bytes = soup::encode_vertices(triangles);
  for (std::size_t n = 0; n + 8 < bytes.size(); n += 7)
    CHECK_THROWS_WITH(soup::decode_vertices(std::span(bytes).first(n), 50, "x.glb"), Contains("x.glb"));
  CHECK_THROWS_WITH(soup::decode_vertices(bytes, std::size_t(1) << 40, "x.glb"), Contains("x.glb"));
  // Copies of one triangle compress to almost nothing, so a minimum size limits the memory of a reader.
  const std::vector<soup::GridTriangle> copies(10000, soup::GridTriangle{});
  const std::vector<std::byte> few = soup::encode_vertices(copies);
  CHECK(few.size() == 4 * (10000 - 4096));
  CHECK(soup::decode_vertices(few, 10000, "x").size() == 10000);
  CHECK_THROWS_WITH(soup::decode_vertices(std::span(few).first(few.size() - 4), 10000, "x.glb"), Contains("truncated"));
  std::size_t refused = 0;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    soup::Random random(seed);
    std::vector<std::byte> noise(400);
    for (std::byte& b : noise) b = std::byte(random.below(256));
    try {
      for (const auto& t : soup::decode_vertices(noise, 20, "x"))
        for (const glm::ivec3& corner : t.corners)
          CHECK(glm::all(glm::lessThanEqual(glm::abs(corner), glm::ivec3(soup::kMostSteps))));
    } catch (const Error&) {
      ++refused;
    }
  }
  CHECK(refused > 0);
  triangles[7].corners[2].y = soup::kMostSteps + 1;
  CHECK_THROWS_WITH(soup::encode_vertices(triangles), Contains("exceeds its grid"));
  triangles[7] = {soup::kMostExponent + 1, {}};
  CHECK_THROWS_WITH(soup::encode_vertices(triangles), Contains("exceeds its grid"));
}

TEST_CASE("the grid of a triangle follows from the photograph that shows it closest", "[vertex_grid]") {
  soup::Model model = ball_of(1);
  model.vertices = {{0, 0, 2}, {0.5f, 0, 2.5f}, {0, 0.5f, 2}};
  const auto exponent = [&](std::vector<soup::ModelCamera> cameras, double share) {
    return soup::on_grid(model, cameras, share)[0].exponent;
  };
  // A pixel is 2 / 100, an eighth of it 1 / 400, so the steps are 1 / 512.
  CHECK(exponent({camera_at({0, 0, 0}, 100)}, 0.125) == 9);
  CHECK(exponent({camera_at({0, 0, 0}, 100)}, 0.25) == 8);
  CHECK(exponent({camera_at({0, 0, 0}, 200)}, 0.125) == 10);
  // A camera at half the distance, and one that does not see the triangle.
  CHECK(exponent({camera_at({0, 0, 0}, 100), camera_at({0, 0, 1}, 100)}, 0.125) == 10);
  CHECK(exponent({camera_at({0, 0, 0}, 100), camera_at({2, 0, 1.9}, 100)}, 0.125) == 9);
  // Behind all cameras: the distance to the nearest corner counts.
  CHECK(exponent({camera_at({0, 0, 3}, 100)}, 0.125) == 11);  // 800 / 0.71 steps per unit
  // Too far for any grid, and far enough that the precision of floats limits the grid.
  model.vertices[1].x = 1e20f;
  CHECK_THROWS_WITH(exponent({camera_at({0, 0, 0}, 100)}, 0.125), Contains("`vertex_share` to 0"));
  model.vertices[1].x = 1e6f;
  CHECK(exponent({camera_at({0, 0, 0}, 100)}, 0.125) == 4);
}

TEST_CASE("rounding to the grid moves no corner by more than the given part of a pixel", "[vertex_grid]") {
  soup::Model model = ball_of(400);
  model.centre = {3, -2, 1};
  model.origin = {10, 20, 30};
  model.scale = 0.25;
  for (glm::vec3& v : model.vertices) v = glm::vec3(glm::dvec3(v) / model.scale + model.centre - model.origin);
  const std::vector<soup::ModelCamera> cameras{camera_at({0, 0, 0}, 90), camera_at({0.3, 0.1, 1.2}, 120)};
  for (const double share : {0.5, 0.0625}) {
    soup::Model rounded = model;
    rounded.vertices = soup::from_grid(soup::on_grid(model, cameras, share), model);
    const auto was = soup::normalised_vertices(model), is = soup::normalised_vertices(rounded);
    double max_shift = 0;
    for (std::size_t i = 0; i < was.size(); ++i)
      for (const soup::ModelCamera& c : cameras) {
        const auto pixel = [&](const glm::vec3& v) {
          const glm::dvec3 p = c.camera.world_to_camera * glm::dvec4(v, 1);
          return glm::dvec2(c.camera.fx * p.x / p.z, c.camera.fy * p.y / p.z);
        };
        max_shift = std::max(max_shift, glm::distance(pixel(was[i]), pixel(is[i])));
      }
    // At most half a step along each axis. The step in depth counts by half, for view angles up to 30 degrees.
    CHECK(max_shift < 0.5 * share * (std::sqrt(2.0) + 0.6));
    CHECK(max_shift > 0.15 * share);
  }
}

TEST_CASE("along_curve() sorts triangles and their textures by position", "[vertex_grid]") {
  soup::Model model = ball_of(3000);
  model.vertices[100].x = 1e30f;  // must not affect the others
  const soup::Model sorted = soup::along_curve(model);
  const auto middle = [](const soup::Model& m, std::size_t t) {
    return (m.vertices[3 * t] + m.vertices[3 * t + 1] + m.vertices[3 * t + 2]) / 3.0f;
  };
  std::vector<bool> seen(3000, false);
  double before = 0, after = 0;
  for (std::size_t i = 0; i < 3000; ++i) {
    const std::size_t t = sorted.textures[i].lattice_offset / soup::samples_at(0);
    CHECK(!seen[t]);
    seen[t] = true;
    for (std::size_t k = 0; k < 3; ++k) CHECK(sorted.vertices[3 * i + k] == model.vertices[3 * t + k]);
    if (i == 0) continue;
    before += std::min(1.0f, glm::distance(middle(model, i), middle(model, i - 1)));
    after += std::min(1.0f, glm::distance(middle(sorted, i), middle(sorted, i - 1)));
  }
  CHECK(after < 0.3 * before);
}
