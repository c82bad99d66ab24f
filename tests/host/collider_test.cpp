// Tests engine/format/collider.cpp.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/error.h"
#include "format/collider.h"
#include "format/glb.h"
#include "mesh/mesh.h"

using namespace trisoup;

namespace {

void add(soup::Model& model, glm::vec3 a, glm::vec3 b, glm::vec3 c, std::uint8_t opacity = 255) {
  soup::TextureEntry row;
  row.lattice_offset = static_cast<std::uint32_t>(model.lattice.size() / soup::kChannels);
  model.vertices.insert(model.vertices.end(), {a, b, c});
  model.textures.push_back(row);
  for (std::uint32_t s = 0; s < soup::samples_at(0); ++s)
    for (int channel = 0; channel < soup::kChannels; ++channel) model.lattice.push_back(channel == 7 ? opacity : 0);
}

/// A floor at z = 0 over -1..1 of separate triangles with gaps of 0.02.
soup::Model floor_of_tiles() {
  soup::Model model;
  const float step = 0.1f, gap = 0.02f;
  for (int i = -10; i < 10; ++i)
    for (int j = -10; j < 10; ++j) {
      const float x = i * step, y = j * step, s = step - gap;
      add(model, {x, y, 0}, {x + s, y, 0}, {x, y + s, 0});
      add(model, {x + s, y + s, 0}, {x, y + s, 0}, {x + s, y, 0});
    }
  return model;
}

/// Sum of the area vectors of the faces; 0 if the mesh is closed. (Edges cannot be counted, because triangles without
/// area have been dropped.)
double open_area(const soup::Mesh& mesh) {
  glm::dvec3 sum(0.0);
  for (std::size_t k = 0; k < mesh.indices.size(); k += 3) {
    const glm::dvec3 a(mesh.positions[mesh.indices[k]]), b(mesh.positions[mesh.indices[k + 1]]),
        c(mesh.positions[mesh.indices[k + 2]]);
    sum += 0.5 * glm::cross(b - a, c - a);
  }
  return glm::length(sum);
}

/// Heights at which a vertical line intersects the mesh, with +1 for faces that point up and -1 for faces that point
/// down.
std::vector<std::pair<float, int>> passes(const soup::Mesh& mesh, glm::dvec2 at) {
  std::vector<std::pair<float, int>> result;
  for (std::size_t k = 0; k < mesh.indices.size(); k += 3) {
    const glm::dvec3 a(mesh.positions[mesh.indices[k]]), b(mesh.positions[mesh.indices[k + 1]]),
        c(mesh.positions[mesh.indices[k + 2]]);
    const auto area = [](const glm::dvec2& p, const glm::dvec2& q, const glm::dvec2& r) {
      return (q.x - p.x) * (r.y - p.y) - (q.y - p.y) * (r.x - p.x);
    };
    const double whole = area(a, b, c), u = area(at, b, c) / whole, v = area(a, at, c) / whole;
    if (whole == 0 || u < 0 || v < 0 || u + v > 1) continue;
    result.emplace_back(static_cast<float>(u * a.z + v * b.z + (1 - u - v) * c.z), whole > 0 ? 1 : -1);
  }
  return result;
}

}  // namespace

TEST_CASE("a collider of separate tiles is a closed slab without holes") {
  soup::Model model = floor_of_tiles();
  const std::size_t budget = 300;
  const soup::Mesh mesh = soup::collision_mesh(model, budget);
  REQUIRE(mesh.triangles() <= budget);
  REQUIRE(open_area(mesh) < 1e-5);
  // The grid has 34 cells along a length of 3. No corner is farther from the floor than 3/4 of a cell.
  const float cell = 3.0f / 34;
  for (const glm::vec3& p : mesh.positions) {
    REQUIRE(std::abs(p.z) < 0.75f * cell);
    REQUIRE(glm::all(glm::lessThan(glm::abs(glm::vec2(p)), glm::vec2(1 + cell))));
  }
  for (double x = -0.93; x < 0.9; x += 0.037)
    for (double y = -0.93; y < 0.9; y += 0.041) {
      const auto found = passes(mesh, {x, y});
      REQUIRE(found.size() == 2);
      for (const auto& [height, up] : found) REQUIRE((height > 0) == (up > 0));
    }
}

TEST_CASE("a collider omits transparent triangles, outliers, specks and the backdrop") {
  soup::Model model = floor_of_tiles();
  for (int i = -10; i < 10; ++i)  // a wall behind the floor makes the box high
    for (int k = 0; k < 10; ++k) {
      const float x = 0.1f * i, z = 0.1f * k;
      add(model, {x, 1, z}, {x + 0.1f, 1, z}, {x, 1, z + 0.1f});
      add(model, {x + 0.1f, 1, z + 0.1f}, {x + 0.1f, 1, z}, {x, 1, z + 0.1f});
    }
  const auto height = [&] {
    float high = 0;
    for (const glm::vec3& p : soup::collision_mesh(model, 300).positions)
      if (p.y < 0.8f) high = std::max(high, std::abs(p.z));
    return high;
  };
  REQUIRE(height() < 0.1f);
  add(model, {-0.5f, -0.5f, 0.5f}, {0.5f, -0.5f, 0.5f}, {0, 0.5f, 0.5f}, 127);  // transparent, inside the box
  add(model, {-0.01f, 0, 0.3f}, {0.01f, 0, 0.3f}, {0, 0.01f, 0.3f});            // a speck
  add(model, {-50, -50, -20}, {50, -50, -20}, {0, 80, -20});                    // far below
  add(model, {0, 0, 40}, {0.1f, 0, 40}, {0, 0.1f, 41});                         // an outlier
  REQUIRE(height() < 0.1f);
  // A triangle that extends beyond the box is clipped.
  add(model, {-30, -0.2f, 0}, {30, -0.2f, 0}, {0, 0.3f, 0});
  for (const glm::vec3& p : soup::collision_mesh(model, 300).positions) REQUIRE(std::abs(p.x) < 2);
  // The same triangle is an obstacle if it is opaque.
  add(model, {-0.5f, -0.5f, 0.5f}, {0.5f, -0.5f, 0.5f}, {0, 0.5f, 0.5f});
  REQUIRE(height() > 0.4f);
}

TEST_CASE("a collider file has the position of the soup, and no opaque triangle is an error") {
  const soup::Mesh mesh = soup::collision_mesh(floor_of_tiles(), 200);
  const nlohmann::json node = {{"mesh", 0}, {"name", "soup"}, {"translation", {1, 2, 3}}};
  const std::vector<std::byte> file = soup::encode_collider(mesh, node);
  const soup::Mesh back = soup::read_gltf(file, "", "collider.glb");
  REQUIRE(back.triangles() == mesh.triangles());
  for (std::size_t i = 0; i < mesh.indices.size(); ++i)
    REQUIRE(glm::distance(back.positions[back.indices[i]], mesh.positions[mesh.indices[i]] + glm::vec3(1, 2, 3)) <
            1e-5f);

  soup::Model clear;
  add(clear, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 127);
  REQUIRE_THROWS_AS(soup::collision_mesh(clear, 100), Error);
  soup::Model point;
  add(point, {1, 1, 1}, {1, 1, 1}, {1, 1, 1});
  REQUIRE_THROWS_AS(soup::collision_mesh(point, 100), Error);
}
