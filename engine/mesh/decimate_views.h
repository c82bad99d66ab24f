// Mesh decimation weighted by the error in known views.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "mesh/mesh.h"

namespace trisoup::soup {

/// Returns the surface with at most `budget` triangles. Edges are collapsed into one of their ends, in order of the
/// weighted squared distances from that end to the planes that met at both ends (Garland, Heckbert, "Surface
/// Simplification Using Quadric Error Metrics", SIGGRAPH 1997). Corners do not move. weights: per triangle, finite, 0
/// or more; the cost of a squared distance to its plane, summed over all pictures. Holes and handles are kept as long
/// as the budget allows. Any indexed triangles are accepted, including surfaces that fold or touch themselves. Returns
/// three indices into mesh.positions per remaining triangle. The result is the same on every machine.
std::vector<std::uint32_t> decimate_views(const Mesh& mesh, std::span<const double> weights, std::size_t budget);

/// Sums of those squared distances after decimate_views() to each of `sizes`, which descend; infinity
/// for sizes that are not reached without folds and closed holes.
std::vector<double> decimation_errors(const Mesh& mesh, std::span<const double> weights,
                                      std::span<const std::size_t> sizes);

}  // namespace trisoup::soup
