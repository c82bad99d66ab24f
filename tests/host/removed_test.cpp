// Tests soup/removed.h: which triangles were cut out of a model.
#include "soup/removed.h"

#include <catch2/catch.hpp>

using namespace trisoup;
using namespace trisoup::soup;

namespace {

/// A model of triangles at x = 0, 1, 2 and so on.
Model row_of_triangles(int count) {
  Model model;
  for (int t = 0; t < count; ++t) {
    const auto x = static_cast<float>(t);
    model.vertices.insert(model.vertices.end(), {{x, 0, 0}, {x + 1, 0, 0.1f}, {x, 1, 0.3f}});
    model.textures.push_back({});
  }
  return model;
}

}  // namespace

TEST_CASE("Removed triangles are those that the cleaned model lacks, in any order", "[removed]") {
  const Model original = row_of_triangles(4);
  Model cleaned;
  for (const std::size_t t : {3, 1}) {  // in another order, and with turned corners
    for (const std::size_t k : {2, 0, 1}) cleaned.vertices.push_back(original.vertices[3 * t + k]);
    cleaned.textures.push_back({});
  }
  const Removed removed = removed_triangles(original, cleaned);
  CHECK(removed.triangles == std::vector<bool>{true, false, true, false});
  CHECK(removed.count == 2);
  CHECK(removed.strangers == 0);
}

TEST_CASE("Triangles that have moved are strangers", "[removed]") {
  const Model original = row_of_triangles(3);
  Model moved = original;
  moved.vertices[4].y = 1e-6f;
  const Removed removed = removed_triangles(original, moved);
  CHECK(removed.triangles == std::vector<bool>{false, true, false});
  CHECK(removed.strangers == 1);
  CHECK(removed_triangles(original, original).count == 0);
}

TEST_CASE("Triangles are compared in dataset coordinates", "[removed]") {
  Model original = row_of_triangles(3), cleaned = row_of_triangles(2);
  original.origin = cleaned.origin = {4e6, 0, 0};
  CHECK(removed_triangles(original, cleaned).triangles == std::vector<bool>{false, false, true});
  cleaned.origin = {4e6 + 1, 0, 0};
  const Removed removed = removed_triangles(original, cleaned);
  CHECK(removed.triangles == std::vector<bool>{true, false, false});
  CHECK(removed.strangers == 0);
}
