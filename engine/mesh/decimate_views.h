// Fewer triangles for a surface that is looked at from known cameras.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "mesh/mesh.h"

namespace trisoup::soup {

/// The surface with at most `budget` triangles: edges are collapsed into one of their ends, in the order of the squared
/// distances from that end to the planes that met at both (Garland, Heckbert, "Surface Simplification Using Quadric
/// Error Metrics", SIGGRAPH 1997), each plane counted by what an error there is worth. Corners stay where they are.
/// weights: per triangle, finite, 0 or more; what a distance to its plane costs, squared, as a sum over all pictures.
/// Holes and handles stay as long as the budget allows it. Any indexed triangles will do, a surface that folds or
/// touches itself too. Returns the corners of the triangles that are left, as numbers of mesh.positions, three each;
/// the same on every machine.
std::vector<std::uint32_t> decimate_views(const Mesh& mesh, std::span<const double> weights, std::size_t budget);

}  // namespace trisoup::soup
