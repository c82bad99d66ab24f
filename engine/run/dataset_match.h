// Checks if a dataset is the one that a model was trained on.
#pragma once

#include <cstdint>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "format/model_file.h"
#include "scene/scene.h"

namespace trisoup::train {

/// Fingerprints of a dataset, as a model's settings store them under "dataset": {"cameras", "test_photographs"}.
nlohmann::json fingerprints_of(const scene::Scene& scene);

/// Describes how `scene` differs from the dataset of the model, in one line that begins with `dataset`. Empty if they
/// match. Each view must match the model's camera of the same name, or, if no camera has its name, any camera:
/// position within 1 % of the cameras' mean distance from the scene, direction within one degree and field of view
/// within 1 %. Photographs of test views are compared only if `as_trained`: they were loaded with the model's own
/// options. Models of other programs have neither cameras nor fingerprints and match every dataset.
std::string mismatch(const soup::ModelFile& file, const scene::Scene& scene, bool as_trained,
                     const std::string& dataset);

}  // namespace trisoup::train
