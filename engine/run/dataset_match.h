// Checks if a dataset is the one that a model was trained on.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

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

/// The split of a model's training, applied to the photographs of a dataset as it is today.
struct RecordedSplit {
  std::vector<std::optional<bool>> test;  // [views] whether it was a test view; nothing if the model does not know it
  std::vector<std::string> missing;       // recorded test views that none of the views matches
  std::size_t recorded = 0;               // number of test views of the training
};

/// Finds each view in the model's cameras: by name, else by path without extension, else by file name without
/// extension, if that is unique among the views and among the cameras. The last two ignore letter case, Unicode form
/// and kind of slash. names: of photographs, relative to the dataset. cameras: of the same length, in the dataset's
/// coordinates. Returns nullopt if the dataset is not the model's: no name matches, as for models without cameras, or
/// most of the matches have another pose.
std::optional<RecordedSplit> recorded_split(const soup::ModelFile& file, const std::vector<std::string>& names,
                                            const std::vector<scene::Camera>& cameras);

/// Changes `test`, which has a flag for each view, to the split of the model's training. Photographs that the model
/// does not know become training views, which soup-eval does not measure. Leaves `test` unchanged without a recorded
/// split. Returns lines for the user, without the dataset's name: about recorded test views that are missing and about
/// unknown photographs.
std::vector<std::string> apply_recorded_split(const soup::ModelFile& file, const std::vector<std::string>& names,
                                              const std::vector<scene::Camera>& cameras, std::vector<bool>& test);

/// Describes how the test views of `scene`, chosen by `test_every`, differ from those of the model's training, in which
/// `recorded` was given: "`test_every` 2 differs from the training's 8: 4 of 8 test views were trained on". Empty if
/// they are the same, or without a recorded split.
std::string split_difference(const soup::ModelFile& file, const scene::Scene& scene, int test_every, int recorded);

}  // namespace trisoup::train
