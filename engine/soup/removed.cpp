#include "soup/removed.h"

#include <algorithm>
#include <array>

namespace trisoup::soup {
namespace {

using Key = std::array<double, 9>;

/// The corners in dataset coordinates, sorted.
Key key_of(const Model& model, std::size_t triangle) {
  std::array<std::array<double, 3>, 3> corners;
  for (std::size_t k = 0; k < 3; ++k) {
    const glm::dvec3 v = glm::dvec3(model.vertices[3 * triangle + k]) + model.origin;
    corners[k] = {v.x, v.y, v.z};
  }
  std::sort(corners.begin(), corners.end());
  Key key;
  for (std::size_t i = 0; i < 9; ++i) key[i] = corners[i / 3][i % 3];
  return key;
}

std::vector<Key> keys_of(const Model& model) {
  std::vector<Key> keys;
  keys.reserve(model.triangles());
  for (std::size_t t = 0; t < model.triangles(); ++t) keys.push_back(key_of(model, t));
  return keys;
}

std::vector<Key> sorted(std::vector<Key> keys) {
  std::sort(keys.begin(), keys.end());
  return keys;
}

}  // namespace

Removed removed_triangles(const Model& original, const Model& cleaned) {
  const std::vector<Key> before = keys_of(original), after = sorted(keys_of(cleaned));
  Removed removed;
  for (const Key& key : before) removed.triangles.push_back(!std::binary_search(after.begin(), after.end(), key));
  removed.count = static_cast<std::size_t>(std::count(removed.triangles.begin(), removed.triangles.end(), true));
  const std::vector<Key> known = sorted(before);
  for (const Key& key : after) removed.strangers += !std::binary_search(known.begin(), known.end(), key);
  return removed;
}

}  // namespace trisoup::soup
