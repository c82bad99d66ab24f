// Metadata written into the file of a trained model.
#pragma once

#include <vector>

#include "format/model_file.h"
#include "scene/scene.h"
#include "train/config/settings.h"

namespace trisoup::train {

/// Cameras of all views: test views first, then training and validation views.
std::vector<soup::ModelCamera> cameras_of(const scene::Scene& scene);

/// Mean up direction of the cameras, for scenes that do not define one.
glm::dvec3 mean_up(const std::vector<soup::ModelCamera>& cameras);

/// Options for the model file: cameras, up direction, texture precision, and the settings of the training with the
/// dataset's fingerprints and load options; not the baked colours. load: the options with which `scene`
/// was loaded.
soup::ModelFileOptions model_options(const scene::Scene& scene, const Settings& settings,
                                     const scene::LoadOptions& load);

/// Writes a model of one triangle with these options to memory and reads it back, so that a scene that no model file
/// can store is refused before it is trained. Throws Error; if a camera is the cause, the message names its photograph.
void check_storable(const scene::Scene& scene, const soup::ModelFileOptions& options);

}  // namespace trisoup::train
