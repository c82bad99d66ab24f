// The model that the viewer shows, its cameras, and how its dataset is loaded.
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
  std::optional<glm::dvec3> up;            // up direction of the dataset, if known
  render::Framing framing;
  double near = 0.025, far = 2.5;  // normalised units
  scene::LoadOptions load;         // how the model's dataset was loaded
};

/// Reads a model. Takes the cameras from `dataset` unless it is empty. up: replaces the up direction of the file.
/// Throws Error if the model or the dataset cannot be read.
Subject load_subject(const std::string& model, const std::string& dataset, const std::optional<glm::vec3>& up);

/// Replaces the cameras by those of a dataset. Throws Error if it cannot be read.
void take_cameras(Subject& subject, const std::string& dataset);

/// Reads a dataset without its photographs. Throws Error if it cannot be read.
void check_dataset(const Subject& subject, const std::string& dataset);

/// Sorts the cameras, test views first, and computes the framing.
void frame_subject(Subject& subject);

/// Returns the index of the camera with this number or name. Throws Error if there is none.
std::size_t find_camera(const Subject& subject, const std::string& which);

}  // namespace trisoup::viewer
