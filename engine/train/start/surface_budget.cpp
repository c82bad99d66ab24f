#include "train/start/surface_budget.h"

#include <algorithm>
#include <vector>

#include "mesh/decimate_views.h"

namespace trisoup::train {

std::size_t surface_budget(const scene::Scene& scene, const soup::Mesh& mesh, std::span<const double> weights,
                           double least_shift, std::size_t least, std::size_t most) {
  // Single collapses differ too much; a tenth of the triangles tells what one more is worth.
  constexpr double kRatio = 0.9;
  std::vector<std::size_t> sizes{most};
  while (sizes.back() > least)
    sizes.push_back(std::max(least, static_cast<std::size_t>(kRatio * static_cast<double>(sizes.back()))));
  double pixels = 0;
  for (const scene::View& view : scene.train)
    pixels += static_cast<double>(view.camera.width) * static_cast<double>(view.camera.height);
  const std::vector<double> errors = soup::decimation_errors(mesh, weights, sizes);
  std::size_t i = 0;
  while (i + 1 < sizes.size() &&
         errors[i + 1] - errors[i] <= least_shift * pixels * static_cast<double>(sizes[i] - sizes[i + 1]))
    ++i;
  return sizes[i];
}

}  // namespace trisoup::train
