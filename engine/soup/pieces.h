// Connected pieces of a soup. Its triangles share no vertices, and neighbours leave gaps or intersect each other.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/glm.hpp>

namespace trisoup::soup {

struct Piece {
  std::vector<std::uint32_t> triangles;  // ascending
  double area = 0;                       // squared units of the vertices
};

/// Returns the pieces, those with most triangles first, then by area: a backdrop of few triangles has most of the area,
/// but not of the scene. Two triangles belong to one piece if a chain of triangles leads from one
/// to the other whose neighbours are at most `gap` apart, measured between surfaces, not vertices: large triangles have
/// their neighbours along their edges. vertices: 3 per triangle, finite. gap: at least 0, units of the vertices.
std::vector<Piece> pieces(std::span<const glm::vec3> vertices, double gap);

/// Returns the median length of the edges; 0 without triangles. The size of a scene says less about the gaps between
/// triangles: few triangles leave wider ones.
double median_edge(std::span<const glm::vec3> vertices);

}  // namespace trisoup::soup
