// What a trained model's file says beside the model.
#pragma once

#include <vector>

#include "format/model_file.h"
#include "scene/scene.h"
#include "train/config/settings.h"

namespace trisoup::train {

/// Test views first, then training and validation views.
std::vector<soup::ModelCamera> cameras_of(const scene::Scene& scene);

/// Cameras, the up direction, where colours are baked from, how exact textures are, and as settings those of the
/// training with what says which dataset it was and how it was read. load: as the scene was.
soup::ModelFileOptions model_options(const scene::Scene& scene, const Settings& settings,
                                     const scene::LoadOptions& load);

}  // namespace trisoup::train
