// Whether a dataset is the one that a model was trained on.
#pragma once

#include <cstdint>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "format/model_file.h"
#include "scene/scene.h"

namespace trisoup::train {

/// What a model's settings keep of its dataset under "dataset": {"cameras", "test_photographs"}, fingerprints.
nlohmann::json fingerprints_of(const scene::Scene& scene);

/// What speaks against `scene` being the dataset of the model, one line that begins with `dataset`; empty where nothing
/// does. Views are compared with the model's cameras of the same names, or where it has none of that name with the
/// nearest one: position (to 1 % of the cameras' mean distance from the scene), direction (to a degree) and field of
/// view (to 1 %). Photographs of the test views are compared where `as_trained` says that they were loaded with the
/// model's own options. Models of other programs have neither cameras nor fingerprints.
std::string mismatch(const soup::ModelFile& file, const scene::Scene& scene, bool as_trained,
                     const std::string& dataset);

}  // namespace trisoup::train
