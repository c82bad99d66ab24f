#include "subject.h"

#include <algorithm>
#include <charconv>

#include <fmt/format.h>

#include "base/error.h"
#include "base/printable.h"

namespace trisoup::viewer {
namespace {

/// Converts a camera between normalised coordinates.
scene::Camera moved(const scene::Camera& camera, const scene::Normalisation& from, const scene::Normalisation& to) {
  scene::Camera c = camera;
  const glm::dvec3 centre = to.to_normalised(from.to_world(camera.centre()));
  c.world_to_camera[3] = glm::dvec4(-(glm::dmat3(camera.world_to_camera) * centre), 1.0);
  return c;
}

scene::Scene load_cameras(const Subject& s, const std::string& dataset) {
  scene::LoadOptions load = s.load;
  load.train_images = load.test_images = false;
  return scene::load(dataset, load);
}

}  // namespace

Subject load_subject(const std::string& model, const std::string& dataset, const std::optional<glm::vec3>& up) {
  Subject s;
  s.path = soup::model_in(model).string();
  soup::ModelFile file = soup::read_model(s.path);
  s.model = std::move(file.model);
  s.cameras = std::move(file.cameras);
  try {
    if (file.settings.is_object()) {
      s.load.downscale = file.settings.value("resolution", 1.0);
      s.load.test_every = file.settings.value("test_every", 8);
      s.load.invert_masks = file.settings.value("invert_masks", false);
      s.load.outside = file.settings.value("outside", false);
      s.near = file.settings.value("test_near", s.near);
      s.far = file.settings.value("far", s.far);
      s.model.drop_near = file.settings.value("drop_near", file.settings.contains("steps"));
      if (file.settings.value("alpha", "composite") == "mask") s.load.alpha = scene::AlphaUse::mask;
      if (!(s.near >= 1e-6 && s.near < s.far && s.far < 1e37))
        throw Error("{}: its clip planes are invalid; train it again", model);
      const double test_every = file.settings.value("test_every", 8.0);
      if (!(s.load.downscale >= 1 && s.load.downscale < 1e6 && test_every >= 0 && test_every < 1e9))
        throw Error("{}: its settings for the photographs are invalid; train it again", model);
    }
  } catch (const nlohmann::json::exception&) {
    // Settings of another program: keep the defaults.
  }
  // The background of the training, whatever the photographs suggest.
  s.load.background = scene::nearest_background(s.model.background);
  s.up = up ? glm::dvec3(*up) : file.up;
  if (dataset.empty())
    frame_subject(s);
  else
    take_cameras(s, dataset);
  return s;
}

void take_cameras(Subject& s, const std::string& dataset) {
  const scene::Scene scene = load_cameras(s, dataset);
  const scene::Normalisation ours{s.model.centre, s.model.scale};
  s.cameras.clear();
  for (const auto& [views, test] : {std::pair(&scene.test, true), {&scene.train, false}})
    for (const scene::View& v : *views)
      s.cameras.push_back({utf8(v.name), test, moved(v.camera, scene.normalisation, ours)});
  frame_subject(s);
}

void check_dataset(const Subject& s, const std::string& dataset) { load_cameras(s, dataset); }

void frame_subject(Subject& s) {
  std::stable_sort(s.cameras.begin(), s.cameras.end(), [](const auto& a, const auto& b) { return a.test > b.test; });
  std::vector<scene::Camera> cameras;
  for (const soup::ModelCamera& c : s.cameras) cameras.push_back(c.camera);
  s.framing = render::frame(soup::normalised_vertices(s.model), cameras, s.up.value_or(render::mean_up(cameras)));
}

std::size_t find_camera(const Subject& subject, const std::string& which) {
  if (subject.cameras.empty())
    throw Error("--camera {}: {} has no cameras; give --dataset FOLDER", printable(which), subject.path);
  std::size_t number = 0;
  const char* end = which.data() + which.size();
  if (const auto [rest, problem] = std::from_chars(which.data(), end, number); rest == end && !which.empty()) {
    if (problem != std::errc() || number >= subject.cameras.size())
      throw Error("--camera {}: there are {} cameras; give a number from 0 (test views first) or a name", which,
                  subject.cameras.size());
    return number;
  }
  for (std::size_t i = 0; i < subject.cameras.size(); ++i)
    if (subject.cameras[i].name == which) return i;
  throw Error("--camera {}: no view has this name; the first is {}", printable(which),
              printable(subject.cameras[0].name));
}

}  // namespace trisoup::viewer
