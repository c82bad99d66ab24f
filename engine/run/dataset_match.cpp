#include "run/dataset_match.h"

#include <cmath>
#include <map>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/printable.h"

namespace trisoup::train {
namespace {

/// Position of the camera in dataset coordinates.
glm::dvec3 place_of(const scene::Camera& camera, const scene::Normalisation& normalisation) {
  return normalisation.to_world(camera.centre());
}

bool alike(const scene::Camera& a, const scene::Camera& b) {
  const double cosine_of_a_degree = 0.99984769515639123916;
  const double field = (a.fx / a.width) / (b.fx / b.width);
  return glm::dot(a.forward(), b.forward()) > cosine_of_a_degree && std::abs(field - 1) < 0.01;
}

}  // namespace

nlohmann::json fingerprints_of(const scene::Scene& scene) {
  return {{"cameras", fmt::format("{:016x}", scene.fingerprint)},
          {"test_photographs", fmt::format("{:016x}", scene::fingerprint_of_photographs(scene.test))}};
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

}  // namespace trisoup::train
