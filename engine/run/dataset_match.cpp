#include "run/dataset_match.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <map>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/printable.h"
#include "scene/text/name_key.h"

namespace trisoup::train {
namespace {

/// Position of the camera in dataset coordinates.
glm::dvec3 place_of(const scene::Camera& camera, const scene::Normalisation& normalisation) {
  return normalisation.to_world(camera.centre());
}

bool look_alike(const scene::Camera& a, const scene::Camera& b) {
  const double cosine_of_a_degree = 0.99984769515639123916;
  return glm::dot(a.forward(), b.forward()) > cosine_of_a_degree;
}

bool alike(const scene::Camera& a, const scene::Camera& b) {
  const double field = (a.fx / a.width) / (b.fx / b.width);
  return look_alike(a, b) && std::abs(field - 1) < 0.01;
}

std::string without_extension(const std::string& path) {
  const std::size_t dot = path.rfind('.'), slash = path.rfind('/');
  const bool has_one = dot != std::string::npos && dot > 0 && (slash == std::string::npos || dot > slash + 1);
  return has_one ? path.substr(0, dot) : path;
}

/// Keys by which a name is compared, from the strictest to the loosest.
std::array<std::string, 3> keys_of(const std::string& name) {
  std::string turned = name;
  std::replace(turned.begin(), turned.end(), '\\', '/');
  const std::string path = without_extension(scene::name_key(turned));
  const std::size_t slash = path.rfind('/');
  return {name, path, slash == std::string::npos ? path : path.substr(slash + 1)};
}

/// Returns for each name the index of the model's camera that recorded_split() finds.
std::vector<std::optional<std::size_t>> find_by_name(const std::vector<soup::ModelCamera>& cameras,
                                                     const std::vector<std::string>& names) {
  std::vector<std::array<std::string, 3>> known, given;
  for (const soup::ModelCamera& camera : cameras) known.push_back(keys_of(camera.name));
  for (const std::string& name : names) given.push_back(keys_of(utf8(name)));
  std::vector<std::optional<std::size_t>> camera_of(names.size());
  std::vector<bool> taken(cameras.size());
  for (std::size_t tier = 0; tier < 3; ++tier) {
    std::map<std::string, std::vector<std::size_t>> by_key;
    std::map<std::string, std::size_t> count;
    for (std::size_t i = 0; i < known.size(); ++i) by_key[known[i][tier]].push_back(i);
    for (const auto& keys : given) ++count[keys[tier]];
    for (std::size_t i = 0; i < given.size(); ++i) {
      const auto found = by_key.find(given[i][tier]);
      if (camera_of[i] || found == by_key.end() || found->second.size() > 1 || count[given[i][tier]] > 1) continue;
      if (taken[found->second[0]]) continue;
      camera_of[i] = found->second[0];
      taken[found->second[0]] = true;
    }
  }
  return camera_of;
}

}  // namespace

nlohmann::json fingerprints_of(const scene::Scene& scene) {
  return {{"cameras", fmt::format("{:016x}", scene.fingerprint)},
          {"test_photographs",
           fmt::format("{:016x}", scene.whole ? scene.whole->test : scene::fingerprint_of_photographs(scene.test))}};
}

std::string mismatch(const soup::ModelFile& file, const scene::Scene& scene, bool as_trained,
                     const std::string& dataset) {
  const scene::Normalisation model{file.model.centre, file.model.scale};
  std::map<std::string, const soup::ModelCamera*> by_name;
  for (const soup::ModelCamera& camera : file.cameras) by_name.emplace(camera.name, &camera);
  std::size_t views = 0, named = 0, fitting = 0;
  std::string first;
  for (const auto* set : {&scene.test, &scene.train})
    for (const scene::View& view : *set) {
      ++views;
      const glm::dvec3 place = place_of(view.camera, scene.normalisation);
      const auto far = [&](const soup::ModelCamera& camera) {
        return glm::distance(place, place_of(camera.camera, model)) * file.model.scale;
      };
      const auto found = by_name.find(utf8(view.name));
      if (found != by_name.end()) ++named;
      bool fits = false;
      if (found != by_name.end())
        fits = far(*found->second) < 0.01 && alike(view.camera, found->second->camera);
      else
        for (const soup::ModelCamera& camera : file.cameras)
          fits = fits || (far(camera) < 0.01 && alike(view.camera, camera.camera));
      if (fits)
        ++fitting;
      else if (first.empty())
        first = printable(view.name);
    }
  if (!file.cameras.empty() && fitting < views)
    return named == 0 ? fmt::format(
                            "{}: {} of {} views match no camera of the model, by pose or by name (first: {}); give the "
                            "dataset that the model was trained on",
                            dataset, views - fitting, views, first)
                      : fmt::format(
                            "{}: poses or lenses of {} of {} views differ from those of the training (first: {}); give "
                            "the dataset that the model was trained on, with the same poses",
                            dataset, views - fitting, views, first);
  if (!as_trained || !file.settings.is_object() || !file.settings.contains("dataset")) return {};
  const nlohmann::json then = file.settings["dataset"], now = fingerprints_of(scene);
  if (!then.is_object() || then.value("cameras", now["cameras"]) != now["cameras"]) return {};
  if (then.value("test_photographs", now["test_photographs"]) != now["test_photographs"])
    return fmt::format(
        "{}: test photographs or masks differ from those of the training, the cameras match; give the original files",
        dataset);
  return {};
}

std::optional<RecordedSplit> recorded_split(const soup::ModelFile& file, const std::vector<std::string>& names,
                                            const std::vector<scene::Camera>& cameras) {
  const scene::Normalisation model{file.model.centre, file.model.scale};
  const std::vector<std::optional<std::size_t>> camera_of = find_by_name(file.cameras, names);
  RecordedSplit split;
  split.test.resize(names.size());
  std::vector<bool> taken(file.cameras.size());
  std::size_t found = 0, agreeing = 0;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (!camera_of[i]) continue;
    const soup::ModelCamera& then = file.cameras[*camera_of[i]];
    split.test[i] = then.test;
    taken[*camera_of[i]] = true;
    ++found;
    const double distance = glm::distance(cameras[i].centre(), place_of(then.camera, model)) * file.model.scale;
    agreeing += distance < 0.01 && look_alike(cameras[i], then.camera);
  }
  if (found == 0 || 2 * agreeing < found) return std::nullopt;
  for (std::size_t i = 0; i < file.cameras.size(); ++i) {
    if (!file.cameras[i].test) continue;
    ++split.recorded;
    if (!taken[i]) split.missing.push_back(file.cameras[i].name);
  }
  return split;
}

std::vector<std::string> apply_recorded_split(const soup::ModelFile& file, const std::vector<std::string>& names,
                                              const std::vector<scene::Camera>& cameras, std::vector<bool>& test) {
  const auto split = recorded_split(file, names, cameras);
  if (!split) return {};
  std::map<std::string, std::size_t> count;
  for (const std::string& name : names) ++count[name];
  std::vector<std::string> unknown, lines;
  for (std::size_t i = 0; i < names.size(); ++i) {
    // A photograph that the dataset lists for training and for testing keeps both roles.
    if (!split->test[i] && count[names[i]] > 1) continue;
    if (!split->test[i]) unknown.push_back(names[i]);
    test[i] = split->test[i].value_or(false);
  }
  if (!split->missing.empty())
    lines.push_back(fmt::format("{} of the {} test views of the training are missing: {}", split->missing.size(),
                                split->recorded, some_names(split->missing)));
  if (!unknown.empty())
    lines.push_back(fmt::format("the model does not know {} of {} photographs, which are not test views: {}",
                                unknown.size(), names.size(), some_names(unknown)));
  return lines;
}

std::string split_difference(const soup::ModelFile& file, const scene::Scene& scene, int test_every, int recorded) {
  std::vector<std::string> names;
  std::vector<scene::Camera> cameras;
  for (const auto* set : {&scene.test, &scene.train})
    for (const scene::View& view : *set) {
      names.push_back(view.name);
      cameras.push_back(view.camera);
      // Turns the normalised camera into one of the dataset: x = R (s (w - c)) + t, divided by s.
      const glm::dvec3 moved = glm::dvec3(view.camera.world_to_camera[3]) / scene.normalisation.scale -
                               glm::dmat3(view.camera.world_to_camera) * scene.normalisation.centre;
      cameras.back().world_to_camera[3] = glm::dvec4(moved, 1.0);
    }
  const auto split = recorded_split(file, names, cameras);
  if (!split) return {};
  std::size_t trained = 0, others = 0;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (!split->test[i]) continue;
    if (i < scene.test.size()) trained += !*split->test[i];
    if (i >= scene.test.size()) others += *split->test[i];
  }
  if (trained == 0 && others == 0) return {};
  return fmt::format("`test_every` {} differs from the training's {}: {} of {} test views were trained on", test_every,
                     recorded, trained, scene.test.size());
}

}  // namespace trisoup::train
