#include "train/start/initial_triangles.h"

#include "base/error.h"
#include "mesh/mesh.h"
#include "train/start/random_start.h"
#include "train/start/surface_start.h"

namespace trisoup::train {

void take_budget(Settings& settings, const Start& start) {
  if (surface_decides_budget(settings)) set_budget(settings, static_cast<std::uint32_t>(start.vertices.size() / 3));
}

Start initial_triangles(const scene::Scene& scene, const Settings& settings) {
  if (settings.init == "random") {
    const glm::vec3 centre(settings.init_centre[0], settings.init_centre[1], settings.init_centre[2]);
    const glm::vec3 half(static_cast<float>(settings.init_box));
    return soup::triangles_in_box(settings.init_count, centre - half, centre + half, settings.init_radius,
                                  settings.seed);
  }
  if (settings.init == "surface") return surface_start(scene, settings);
  if (settings.init == "points") {
    if (scene.points.positions.empty())
      throw Error("{}: has no points to start from; set `init` to random or to a mesh file", scene.path.string());
    soup::FromPoints options;
    options.farthest_count = (2 * settings.init_count + 2) / 3;
    options.random_count = settings.init_count - options.farthest_count;
    options.seed = settings.seed;
    return soup::triangles_from_points(scene.points.positions, options);
  }
  std::vector<glm::vec3> vertices = soup::triangles_from_mesh(soup::read_mesh(settings.init), settings.triangles);
  for (glm::vec3& v : vertices) v = glm::vec3(scene.normalisation.to_normalised(glm::dvec3(v)));
  return vertices;
}

}  // namespace trisoup::train
