// Fewer triangles for the same surface.
#pragma once

#include <cstddef>

#include "mesh/mesh.h"

namespace trisoup::soup {

/// The mesh with at most `budget` triangles. Vertices at one place are welded first and triangles without area dropped;
/// then edges are collapsed in the order of quadric error (Garland, Heckbert 1997; meshoptimizer). Where the topology
/// forbids collapses (a mesh of loose triangles), vertices are clustered instead, which can end well below the budget.
/// A mesh within the budget keeps its triangles. Indices must be in range and positions finite (check_mesh).
Mesh decimate(const Mesh& mesh, std::size_t budget);

}  // namespace trisoup::soup
