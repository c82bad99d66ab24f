// Connected pieces of a soup. Its triangles share no vertices, and neighbours leave gaps or intersect each other.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/glm.hpp>

namespace trisoup::soup {

/// Longest edges of the smaller triangle that may lie between two triangles of one piece.
inline constexpr double kUsualGap = 0.05;

struct Piece {
  std::vector<std::uint32_t> triangles;  // ascending
  double area = 0;                       // squared units of the vertices
};

/// Returns the pieces, those with most triangles first, then by area: a backdrop of few triangles has most of the area,
/// but not of the scene. Two triangles belong to one piece if a chain of triangles leads from one to the other in which
/// the distance of neighbours is at most `gap` longest edges of the smaller one. Distances are measured between
/// surfaces, because a large triangle has its small neighbours along its edges, not at its corners. The edge of the
/// smaller triangle is the unit, so that specks do not connect what lies around them, nor a backdrop the scene.
/// vertices: 3 per triangle, finite. gap: at least 0.
std::vector<Piece> pieces(std::span<const glm::vec3> vertices, double gap);

}  // namespace trisoup::soup
