// The vertices of a model on grids as fine as its photographs show, and its triangles in an order in which neighbours
// follow each other.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "format/model_cameras.h"
#include "format/vertex_code.h"
#include "soup/soup.h"

namespace trisoup::soup {

/// Each triangle's corners rounded to steps of the largest power of two, in normalised coordinates, that is no more
/// than `share` of the pixel in which a camera shows the triangle closest: a corner is off by half as much along an
/// axis at most. What no camera shows is measured by the nearest one. share > 0; at least one camera, in normalised
/// coordinates. Throws Error on a triangle beyond any grid.
std::vector<GridTriangle> on_grid(const Model& model, std::span<const ModelCamera> cameras, double share);

/// Vertices as `model` has them, in its coordinates (centre, scale, origin).
std::vector<glm::vec3> from_grid(std::span<const GridTriangle> triangles, const Model& model);

/// The model with its triangles along a Z-order curve (Morton 1966) through the ranks of their middles, which is the
/// same for any unit and however far single ones lie. Textures follow in the table; the lattice stays where it is.
Model along_curve(const Model& model);

}  // namespace trisoup::soup
