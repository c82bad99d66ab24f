#include "run/model_options.h"

#include <cmath>

#include "base/printable.h"
#include "format/lattice_hierarchy.h"
#include "mesh/point_spacing.h"
#include "render/cameras.h"
#include "run/dataset_match.h"
#include "train/start/random_start.h"

namespace trisoup::train {
namespace {

/// Eight directions from the origin, spread over the directions of the cameras.
std::vector<glm::vec3> bake_directions(const scene::Scene& scene) {
  std::vector<glm::vec3> all, chosen;
  for (const scene::View& view : scene.train) {
    const glm::dvec3 centre = view.camera.centre();
    if (glm::length(centre) > 1e-6) all.emplace_back(glm::normalize(centre));
  }
  for (const std::uint32_t i : soup::farthest_points(all, 8)) chosen.push_back(all[i]);
  return chosen;
}

/// Mean up direction of the cameras, for scenes that do not define one.
glm::dvec3 mean_up(const std::vector<soup::ModelCamera>& cameras) {
  std::vector<scene::Camera> poses;
  for (const soup::ModelCamera& c : cameras) poses.push_back(c.camera);
  return render::mean_up(poses);
}

}  // namespace

std::vector<soup::ModelCamera> cameras_of(const scene::Scene& scene) {
  std::vector<soup::ModelCamera> cameras;
  for (const auto& [views, test] : {std::pair(&scene.test, true), {&scene.train, false}, {&scene.validation, false}})
    for (const scene::View& view : *views) cameras.push_back({utf8(view.name), test, view.camera});
  return cameras;
}

soup::ModelFileOptions model_options(const scene::Scene& scene, const Settings& settings,
                                     const scene::LoadOptions& load) {
  soup::ModelFileOptions options;
  options.settings = to_json(settings);
  options.settings["drop_near"] = settings.published;  // a property of the model for its readers
  options.settings["dataset"] = fingerprints_of(scene);
  options.settings["resolution"] = load.downscale;
  options.settings["test_every"] = load.test_every;
  options.settings["alpha"] = load.alpha == scene::AlphaUse::mask ? "mask" : "composite";
  if (load.outside) options.settings["outside"] = true;
  options.cameras = cameras_of(scene);
  if (scene.synthetic)
    options.up = glm::dvec3(0, 0, 1);
  else if (scene.up)
    options.up = scene.up;
  else
    options.shown_up = mean_up(options.cameras);
  options.bake_directions = bake_directions(scene);
  options.texture_steps = soup::texture_steps(settings.texture_bits);
  options.colour_palette = settings.texture_bits < 8;
  return options;
}

}  // namespace trisoup::train
