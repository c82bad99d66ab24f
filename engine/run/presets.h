// The presets of soup-train: which settings a scene is trained with where nobody says more.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "scene/scene.h"
#include "train/config/settings.h"

namespace trisoup::train {

/// What is asked for of a preset; what is empty is the preset's own.
struct PresetChoice {
  std::string preset;            // "fast", "balanced", "best" or "published"; empty: best
  std::string init;              // as Settings::init
  std::optional<Recipe> recipe;  // empty: by the format of the dataset
  std::optional<std::uint64_t> steps;
  std::optional<std::uint32_t> triangles;
};

/// Whether a start from points is asked for where the dataset may have none.
bool wants_points(const PresetChoice& choice, const scene::Scene& scene);

/// The preset's settings for the scene, scaled to the steps asked for. rate_vertex is left to preset_vertex_rate(),
/// once all else is decided: it depends on the other rates. Throws Error where there is no preset of that name.
Settings of_preset(const PresetChoice& choice, const scene::Scene& scene);
double preset_vertex_rate(const PresetChoice& choice, const Settings& settings);

}  // namespace trisoup::train
