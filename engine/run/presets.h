// From what a user asks for to the settings of a training: presets, and what follows from the scene.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "scene/scene.h"
#include "train/config/settings.h"
#include "train/config/settings_table.h"

namespace trisoup::train {

struct SettingsRequest {
  std::string preset;                   // "fast", "balanced", "best" or "published"; empty: best
  std::vector<Assignment> assignments;  // in order: the last one of a setting counts

  /// The value that was asked for. Null if the setting was not mentioned.
  const SettingValue* find(std::string_view setting) const;
  bool has(std::string_view setting) const { return find(setting) != nullptr; }
};

/// Whether the start needs points of the surfaces that photographs show (scene/stereo/surface_points.h). Scattered
/// points need them only where the dataset has none. init: Settings::init.
bool start_needs_points(const std::string& init, const scene::Scene& scene);
/// The same of the start that a request leads to.
bool wants_points(const SettingsRequest& request, const scene::Scene& scene);

/// The preset's settings for the scene, with every assignment of the request and what follows from them: schedules
/// scale with the steps, and the learning rate of vertices lets them travel far enough. Not checked (check()). Throws
/// Error if there is no such preset.
Settings make_settings(const SettingsRequest& request, const scene::Scene& scene);

/// Applies the assignments alone. `init_box` and `init_radius` of a request are in the dataset's units.
void apply(const SettingsRequest& request, const scene::Scene& scene, Settings& settings);

/// What a goal needs beside itself, unless the request or the settings have it: validation views and steps of a round.
/// lowers_knee: a new training prunes less before it meets a quality, which it may itself decide where to end.
void complete_goal(const SettingsRequest& request, const scene::Scene& scene, bool lowers_knee, Settings& settings);

}  // namespace trisoup::train
