// Encodes the vertices of web models: integer steps on a grid per triangle, arithmetically coded. web/vertices.js has
// the same decoder.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include <glm/glm.hpp>

namespace trisoup::soup {

inline constexpr int kMostExponent = 30, kMostSteps = 1 << 24;  // floats represent this many steps exactly

/// A triangle with corners at steps / 2^exponent.
struct GridTriangle {
  int exponent = 0;  // -kMostExponent..kMostExponent
  /// Steps, each -kMostSteps..kMostSteps.
  std::array<glm::ivec3, 3> corners{glm::ivec3(0), glm::ivec3(0), glm::ivec3(0)};
};

/// Number of triangles that a code of this size may contain. Shorter codes are padded with zeros. It limits the memory
/// that a damaged file can make a reader allocate. Only copies of one triangle need less than this.
constexpr std::size_t most_triangles(std::size_t bytes) { return 4096 + bytes / 4; }

/// Encodes triangles, each relative to the previous one. Consecutive triangles should be close in space.
std::vector<std::byte> encode_vertices(std::span<const GridTriangle> triangles);

/// Decodes triangles. Throws Error, beginning with `name`, if there are too few bytes for this many triangles, if they
/// end too early, or if a number exceeds its limits. Other damage only changes values, so the caller must check the
/// bytes' integrity first.
std::vector<GridTriangle> decode_vertices(std::span<const std::byte> bytes, std::size_t triangles,
                                          const std::string& name);

}  // namespace trisoup::soup
