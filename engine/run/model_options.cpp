#include "run/model_options.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/printable.h"
#include "format/lattice_hierarchy.h"
#include "render/cameras.h"
#include "run/dataset_match.h"
#include "soup/texture_table.h"
#include "train/start/random_start.h"

namespace trisoup::train {
namespace {

/// Returns the name of the camera that is at least a thousand times as far from the median position as half of the
/// cameras, or an empty text. One such camera determines the scale of the whole scene.
std::string far_camera(const std::vector<soup::ModelCamera>& cameras) {
  if (cameras.size() < 3) return {};
  const auto middle_of = [](std::vector<double> values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
  };
  glm::dvec3 middle(0.0);
  for (int i = 0; i < 3; ++i) {
    std::vector<double> values;
    for (const soup::ModelCamera& c : cameras) values.push_back(c.camera.centre()[i]);
    middle[i] = middle_of(values);
  }
  std::vector<double> distances;
  for (const soup::ModelCamera& c : cameras) distances.push_back(glm::distance(c.camera.centre(), middle));
  const auto farthest = std::max_element(distances.begin(), distances.end());
  if (!(*farthest > 1000 * middle_of(distances))) return {};
  return printable(cameras[static_cast<std::size_t>(farthest - distances.begin())].name);
}

}  // namespace

std::vector<soup::ModelCamera> cameras_of(const scene::Scene& scene) {
  std::vector<soup::ModelCamera> cameras;
  for (const auto& [views, test] : {std::pair(&scene.test, true), {&scene.train, false}, {&scene.validation, false}})
    for (const scene::View& view : *views) cameras.push_back({utf8(view.name), test, view.camera});
  return cameras;
}

glm::dvec3 mean_up(const std::vector<soup::ModelCamera>& cameras) {
  std::vector<scene::Camera> poses;
  for (const soup::ModelCamera& c : cameras) poses.push_back(c.camera);
  return render::mean_up(poses);
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
  if (load.invert_masks) options.settings["invert_masks"] = true;
  if (load.outside) options.settings["outside"] = true;
  options.cameras = cameras_of(scene);
  if (scene.synthetic && scene.format == scene::Format::blender)  // Blender's convention
    options.up = glm::dvec3(0, 0, 1);
  else if (scene.up)
    options.up = scene.up;
  else
    options.shown_up = mean_up(options.cameras);
  options.texture_steps = soup::texture_steps(settings.texture_bits);
  options.colour_palette = settings.texture_bits < 8;
  return options;
}

void check_storable(const scene::Scene& scene, const soup::ModelFileOptions& options) {
  soup::check_cameras(options.cameras);
  soup::Model model;
  model.centre = model.origin = scene.normalisation.centre;
  model.scale = scene.normalisation.scale;
  model.background = scene.background;
  model.vertices = {{0.0f, 0.0f, 0.0f}, {1.0f, 0.0f, 0.0f}, {0.0f, 1.0f, 0.0f}};
  model.textures = soup::make_texture_table(1, soup::TextureLevels{0, 0}).entries;
  model.lattice.assign(std::size_t{soup::samples_at(0)} * soup::kChannels, 0);
  try {
    soup::decode_model(soup::encode_model(model, options), scene.path.string());
  } catch (const Error& error) {
    const std::string far = far_camera(options.cameras);
    if (far.empty()) throw;
    throw Error(
        "{}: its camera is far away from all others, so no model can be stored ({}); correct its pose, or "
        "remove the photograph",
        far, error.what());
  }
}

}  // namespace trisoup::train
