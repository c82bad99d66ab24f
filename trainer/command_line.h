// What soup-train is asked to do.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "cli/serve_options.h"
#include "gpu/device.h"
#include "run/checkpoint.h"
#include "run/presets.h"
#include "scene/scene.h"
#include "train/config/settings.h"

namespace trisoup {

struct SettingsFile;

struct CommandLine {
  std::string dataset, output;
  std::string model;  // to be simplified; empty: there is training to be done
  bool list_devices = false, settings_page = false, resume = false, overwrite = false, quiet = false, timings = false;
  bool view = false, finish_headless = false;
  ServeOptions serving;
  bool measure_float = false;       // also the quality of textures before they are rounded
  bool by_itself = false;           // whatever a launcher has started
  bool warnings_elsewhere = false;  // another rank prints those of the dataset
  std::uint64_t log_every = 0, memory_mb = 0;
  std::uint32_t evaluations_per_decade = 0;
  gpu::DeviceOptions device;
  scene::LoadOptions load;
  int feature_size = 1600;

  /// Settings of a new training: those of the record, or of the preset for the scene, with every option that was given.
  /// Throws Error on values that no training can have.
  train::Settings settings(const scene::Scene& scene) const;
  /// Settings with which a model is simplified; `trained`: those of its file. Throws Error if they are no training's.
  train::Settings of_model(const nlohmann::json& trained, const scene::Scene& scene) const;
  /// Settings with which a training continues from a checkpoint: the checkpoint's own, but for how often files are
  /// written, and extended() if more steps are asked for. Throws Error, with both values and `path`, if an option
  /// contradicts them.
  train::Settings resumed(const train::CheckpointInfo& checkpoint, const scene::Scene& scene,
                          const std::filesystem::path& path) const;
  /// What a checkpoint records of the options that are no settings: those of the dataset, the preset, --eval-log. JSON.
  std::string note() const;
  /// How the dataset is read: "resolution", "test_every", "background", "alpha", "invert_masks", "depth_maps",
  /// "depth_unit".
  nlohmann::json dataset_note() const;
  /// Takes from a checkpoint's note what was not given. Throws Error, with both values and `path`, if an option
  /// contradicts it.
  void take(const std::string& note, const std::filesystem::path& path);
  /// Takes the settings of a record, and from its dataset what was not given.
  void take(const SettingsFile& file);
  /// Whether the start needs sparse points, which the dataset may lack.
  bool wants_points(const scene::Scene& scene) const;

  train::SettingsRequest request;         // preset and settings that were given
  std::optional<train::Settings> record;  // of --settings; options win over it
  /// Which options with a default value of their own were given.
  struct {
    bool resolution = false, test_every = false, background = false, alpha = false, feature_size = false,
         evaluations_per_decade = false, invert_masks = false, depth_maps = false, depth_unit = false;
  } given;

 private:
  void take_dataset(const nlohmann::json& then);
  std::string preset_name() const;
  std::string noted_preset_;  // of the checkpoint; empty if it has none
};

/// The value of --depth-maps. Unknown names are automatic.
scene::DepthMaps depth_maps_of(const std::string& name);

/// Exit status to end with, or nothing to go on.
std::optional<int> parse(int argc, char** argv, CommandLine& out);

/// Throws Error if `file`, from which a training starts, lies in the folder that --overwrite clears.
void keep_from_overwrite(const CommandLine& options, const std::filesystem::path& file);

}  // namespace trisoup
