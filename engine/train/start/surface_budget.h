// How many triangles the photographs of a scene need.
#pragma once

#include <cstddef>
#include <span>

#include "mesh/mesh.h"
#include "scene/scene.h"

namespace trisoup::train {

/// Returns the number of triangles, from `least` to `most`, below which each removed triangle of the surface would
/// shift the pixels of the training views by a mean square of more than `least_shift`, in pixels^2. weights: per
/// triangle, squared pixels that a unit of squared distance shifts, summed over all views (decimate_views()).
std::size_t surface_budget(const scene::Scene& scene, const soup::Mesh& mesh, std::span<const double> weights,
                           double least_shift, std::size_t least, std::size_t most);

}  // namespace trisoup::train
