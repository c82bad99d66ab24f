// Settings::removed_from: reads both models and leaves out what one of them lacks.
#pragma once

#include <string>

#include "gpu/device.h"
#include "scene/scene.h"
#include "train/config/settings.h"

namespace trisoup::train {

/// Returns the file that `removed_from` or `init` names and that is not there; empty if both are, or without
/// `removed_from`.
std::string missing_model(const Settings& settings);

/// Takes the pixels that show what was removed before the training out of the loss and of the scores
/// (train/quality/removed_masks.h), and returns a line about them. Does nothing and returns an empty line without
/// `removed_from`. Throws Error if a file cannot be read, if `init` was not cut from `removed_from`, or if it lacks
/// nothing of it.
std::string leave_out_removed(gpu::Device& gpu, scene::Scene& scene, const Settings& settings);

}  // namespace trisoup::train
