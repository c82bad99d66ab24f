// Rounds the vertices of a model to grids as fine as its photographs can show, and sorts triangles so that consecutive
// ones are close in space.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "format/model_cameras.h"
#include "format/vertex_code.h"
#include "soup/soup.h"

namespace trisoup::soup {

/// Rounds each triangle's corners to multiples of a grid step. The step is the largest power of two, in normalised
/// coordinates, that is at most `share` of a pixel of the camera that shows the triangle closest. A corner moves by at
/// most half a step along each axis. Triangles that no camera shows use the nearest camera. share > 0; at least one
/// camera, in normalised coordinates. Throws Error if a triangle is too far away for any grid.
std::vector<GridTriangle> on_grid(const Model& model, std::span<const ModelCamera> cameras, double share);

/// Converts grid triangles to vertices in the coordinates of `model` (centre, scale, origin).
std::vector<glm::vec3> from_grid(std::span<const GridTriangle> triangles, const Model& model);

/// Sorts the triangles along a Z-order curve (Morton 1966) through the ranks of their centres. Ranks make the order
/// independent of units and strays. The texture table is sorted with them; the lattice stays unchanged.
Model along_curve(const Model& model);

}  // namespace trisoup::soup
