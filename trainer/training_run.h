// One training from its command line to its folder: what soup-train and soup-simplify do.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "command_line.h"
#include "format/model_file.h"
#include "gpu/device.h"
#include "progress_bar.h"
#include "ranks/ranks.h"
#include "run/checkpoint.h"
#include "run/part_times.h"
#include "run/run_folder.h"
#include "run/simplifier.h"
#include "run/trainer.h"
#include "scene/scene.h"
#include "together.h"
#include "viewer/live.h"

namespace trisoup {

class TrainingRun {
 public:
  /// live: where a window looks on; null for none. ranks: with whom; they must outlive it.
  TrainingRun(CommandLine options, viewer::Live* live, ranks::Ranks& ranks);
  /// The whole of it. Throws Error, and Interrupted (prepare.h) where a signal has ended it and the checkpoint is there
  /// to go on from.
  void run();

 private:
  void open_device();
  void read_model();
  void read();
  std::optional<train::CheckpointInfo> what_was_begun();
  void begin();
  void join_ranks();
  void train();
  void train_to_the_end(const train::Trainer::Callbacks& callbacks);
  train::Trainer::Callbacks callbacks();
  void save();
  void show_part(train::Part part);
  void log_evaluation(const train::Evaluation& evaluation);
  std::string what_is_saved(const char* where) const;
  void check_fit() const;
  std::unique_ptr<train::Trainer> new_trainer();
  soup::Model result();  // all ranks take part
  /// Saves and measures the model. All ranks take part; the first one writes and reports.
  void finish();
  soup::Model save_model();
  struct Quality {
    train::Evaluation test;
    std::optional<train::Evaluation> unrounded;  // of textures before they are rounded, with --measure-float
    train::TrainingFit fit;
  };
  Quality measure(const soup::Model& model);
  nlohmann::json about_ranks();
  nlohmann::json quality_json(const Quality& quality) const;
  nlohmann::json size_json(const soup::Model& model, std::span<const std::byte> file) const;
  nlohmann::json run_json() const;
  void report(const soup::Model& model, const Quality& quality, const nlohmann::json& ranks);
  bool has_goal() const { return train::has_goal(settings_); }

  /// Of the training, whoever writes it.
  std::filesystem::path checkpoint() const { return std::filesystem::path(o_.output) / "checkpoint.safetensors"; }

  ranks::Ranks& ranks_;
  CommandLine o_;
  viewer::Live* live_;
  RankOutput output_;
  train::RunFolder folder_;
  std::optional<train::CheckpointInfo> begun_;  // what there is to go on from
  std::unique_ptr<gpu::Device> device_;
  std::optional<soup::ModelFile> file_;  // to be simplified
  std::string dataset_;
  scene::Scene scene_;
  train::Settings settings_;
  std::optional<train::PartTimes> times_;
  std::unique_ptr<train::Trainer> trainer_;
  std::unique_ptr<train::Simplifier> simplifier_;
  soup::ModelFileOptions file_options_;
  std::unique_ptr<ProgressBar> bar_;
  std::optional<std::uint64_t> saved_;  // step of the last checkpoint
  std::uint64_t first_step_ = 0;        // of this process
  bool stopped_ = false;                // by a signal, between the rounds of simplifying
};

/// Runs it to an exit status: errors are printed after the program's name, and told in the window.
int run_guarded(const char* program, const CommandLine& options, viewer::Live* live);

}  // namespace trisoup
