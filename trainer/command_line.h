// What soup-train is asked to do.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "gpu/device.h"
#include "run/checkpoint.h"
#include "run/presets.h"
#include "scene/scene.h"
#include "train/config/experiments.h"
#include "train/config/settings.h"

namespace trisoup {

struct SettingsFile;

struct CommandLine {
  std::string dataset, output;
  std::string model;  // to be simplified; empty: there is training to be done
  bool list_devices = false, resume = false, overwrite = false, quiet = false, timings = false;
  bool view = false, finish_headless = false;
  bool measure_float = false;       // also the quality of textures before they are rounded
  bool by_itself = false;           // whatever a launcher has started
  bool warnings_elsewhere = false;  // another rank prints those of the dataset
  std::uint64_t log_every = 0, memory_mb = 0;
  std::uint32_t evaluations_per_decade = 0;
  gpu::DeviceOptions device;
  scene::LoadOptions load;
  int feature_size = 1600;

  /// Those of the record, or the preset's for the scene's recipe, scaled to the steps asked for; with every option that
  /// was given. Throws Error on values that cannot be.
  train::Settings settings(const scene::Scene& scene) const;
  /// The settings with which a model that has been trained with `trained` (of its file) is simplified. Throws Error on
  /// what no training has.
  train::Settings of_model(const nlohmann::json& trained, const scene::Scene& scene) const;
  /// The settings with which a training goes on from a checkpoint: the checkpoint's own, but for how often something is
  /// written, and prolonged (train/config/settings.h) where more --steps are asked for. Throws Error, with both values,
  /// where an option that was given contradicts them; `path` is for that.
  train::Settings resumed(const train::CheckpointInfo& checkpoint, const scene::Scene& scene,
                          const std::filesystem::path& path) const;
  /// What a checkpoint keeps of the options that are no settings: those of the dataset, the preset's name, --eval-log.
  /// JSON.
  std::string note() const;
  /// How the dataset is read: "resolution", "test_every", "background", "alpha".
  nlohmann::json dataset_note() const;
  /// Takes from a checkpoint's note what was not given. Throws Error, with both values, where what was given
  /// contradicts it; `path` is for that.
  void take(const std::string& note, const std::filesystem::path& path);
  /// Takes the settings of a record, and from what it says of the dataset what was not given.
  void take(const SettingsFile& file);
  /// Whether a start from points is asked for where the dataset may have none.
  bool wants_points(const scene::Scene& scene) const;

  // Options that were given; what is empty keeps its default.
  std::optional<std::uint64_t> steps, seed, eval_every, checkpoint_every, round_steps;
  std::optional<std::uint32_t> max_triangles, validation_views;
  std::optional<double> knee, target_psnr, target_ssim, max_megabytes;
  std::optional<std::uint32_t> triangles, init_count, level_max, texture_bits;
  std::optional<double> init_box, init_radius, near, far, test_near;
  std::string preset, init, recipe;
  std::optional<bool> exposure;
  std::vector<train::Assignment> experiments;  // of --set, in order
  std::optional<train::Settings> record;       // of --settings; what was given wins over it
  /// Those of the options of `load`, and of others with a value of their own, that were given.
  struct {
    bool resolution = false, test_every = false, background = false, alpha = false, feature_size = false,
         evaluations_per_decade = false;
  } given;

 private:
  void take_dataset(const nlohmann::json& then);
  void apply(train::Settings& settings, const scene::Scene& scene) const;
  /// What a goal asks for besides, where it was not given.
  void complete_goal(train::Settings& settings, const scene::Scene& scene) const;
  train::PresetChoice choice() const;
  bool sets(const char* name) const;
  std::string preset_name() const;
  std::string noted_preset_;  // of the checkpoint; empty where it does not say
};

/// Exit status to end with, or nothing to go on.
std::optional<int> parse(int argc, char** argv, CommandLine& out);

}  // namespace trisoup
