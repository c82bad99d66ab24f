// Settings::removed_from: reads both models and leaves out what one of them lacks.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "gpu/device.h"
#include "scene/scene.h"
#include "train/config/settings.h"

namespace trisoup::train {

/// The settings of a model's training that say what was removed before it; `removed_from` is empty if nothing was.
/// record: ModelFile::settings.
Settings removal_of(const nlohmann::json& record);

/// Returns the file that `removed_from` or `init` names and that is not there, or one that the record of the model of
/// `removed_from` names so; empty if all are, or without `removed_from`.
std::string missing_model(const Settings& settings);

/// Takes the pixels that show what was removed before the training out of the loss and of the scores
/// (train/quality/removed_masks.h), also what was removed before the training of `removed_from`, and returns a line
/// about each removal. Does nothing and returns an empty line without
/// `removed_from`. Throws Error if a file cannot be read, if `init` was not cut from `removed_from`, or if it lacks
/// nothing of it.
std::string leave_out_removed(gpu::Device& gpu, scene::Scene& scene, const Settings& settings);

}  // namespace trisoup::train
