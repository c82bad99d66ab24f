// Vertices as bytes of a page's model: whole steps on a grid of each triangle's own, arithmetically coded.
// web/vertices.js decodes the same.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include <glm/glm.hpp>

namespace trisoup::soup {

inline constexpr int kMostExponent = 30, kMostSteps = 1 << 24;  // so many steps are exact in a float

/// A triangle with corners at steps / 2^exponent.
struct GridTriangle {
  int exponent = 0;  // -kMostExponent..kMostExponent
  std::array<glm::ivec3, 3> corners{glm::ivec3(0), glm::ivec3(0),
                                    glm::ivec3(0)};  // steps, each -kMostSteps..kMostSteps
};

/// Triangles that so many bytes may tell. The bytes are filled up with zeros where there are more, so that a reader
/// takes memory for nothing that is not there; others than copies of one triangle take more by themselves.
constexpr std::size_t most_triangles(std::size_t bytes) { return 4096 + bytes / 4; }

/// Neighbours in the list had best be neighbours in space: each triangle is told from the one before it.
std::vector<std::byte> encode_vertices(std::span<const GridTriangle> triangles);

/// Throws Error, beginning with `name`, where the bytes are too few for so many triangles, end too early or give a
/// number beyond its limits. What is damaged otherwise gives other values: the caller has to know that the bytes are
/// whole.
std::vector<GridTriangle> decode_vertices(std::span<const std::byte> bytes, std::size_t triangles,
                                          const std::string& name);

}  // namespace trisoup::soup
