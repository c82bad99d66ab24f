// Mesh decimation by quadric error.
#pragma once

#include <cstddef>

#include "mesh/mesh.h"

namespace trisoup::soup {

/// Returns the mesh with at most `budget` triangles. Duplicate vertices are welded and degenerate triangles removed;
/// then edges are collapsed in order of quadric error (Garland, Heckbert 1997; meshoptimizer). If the topology forbids
/// collapses (a mesh of loose triangles), vertices are clustered instead, which can end well below the budget. A mesh
/// within the budget keeps its triangles. Indices must be in range and positions finite (check_mesh).
Mesh decimate(const Mesh& mesh, std::size_t budget);

}  // namespace trisoup::soup
