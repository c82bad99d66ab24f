// What soup-view looks at: a model, the cameras around it, and photographs where there is a dataset.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <glm/glm.hpp>

#include "format/model_file.h"
#include "render/cameras.h"
#include "scene/scene.h"

namespace trisoup::viewer {

struct Subject {
  std::string path;
  soup::Model model;
  std::vector<soup::ModelCamera> cameras;  // test views first; normalised coordinates of the model
  std::optional<glm::dvec3> up;            // of the dataset, where it is known
  render::Framing framing;
  double near = 0.025, far = 2.5;  // normalised units
  scene::LoadOptions load;         // how the model's dataset was loaded
};

/// Throws Error on a file that is no model, or a dataset that is none. dataset: empty for none.
Subject load_subject(const std::string& model, const std::string& dataset, const std::optional<glm::vec3>& up);

/// The cameras of a dataset instead of the model's own. Throws Error.
void take_cameras(Subject& subject, const std::string& dataset);

/// Reads all of a dataset but its photographs. Throws Error where it is none.
void check_dataset(const Subject& subject, const std::string& dataset);

/// Sorts the cameras, test views first, and finds the framing.
void frame_subject(Subject& subject);

/// Index of the camera with this number or name. Throws Error.
std::size_t find_camera(const Subject& subject, const std::string& which);

}  // namespace trisoup::viewer
