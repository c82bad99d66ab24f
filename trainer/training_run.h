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
#include "failures.h"
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
#include "train/quality/aligned_views.h"
#include "viewer/live.h"

namespace trisoup {

/// Exit status of a training that has missed its goal; all its files are written.
inline constexpr int kGoalMissed = 3;

class TrainingRun {
 public:
  /// live: where a window or a page looks on; null for none. ranks: with whom; they must outlive it.
  TrainingRun(CommandLine options, viewer::Live* live, ranks::Ranks& ranks);
  TrainingRun(const TrainingRun&) = delete;
  TrainingRun& operator=(const TrainingRun&) = delete;
  ~TrainingRun();
  /// The whole of it. Returns false if the goal was missed. Throws Error; Incomplete if the training is done but some
  /// of its results are missing; and Interrupted (prepare.h) where a signal has ended it and the checkpoint is there to
  /// go on from.
  bool run();

 private:
  void open_device();
  void read_model();
  void read();
  void leave_out();
  void decide_on_budget();
  void make_start();
  void check_room();
  std::optional<train::CheckpointInfo> what_was_begun();
  void begin();
  void join_ranks();
  void show_to_onlookers();
  void train();
  void train_to_the_end(const train::Trainer::Callbacks& callbacks);
  train::Trainer::Callbacks callbacks();
  void save();
  std::string save_now();
  void save_last();
  bool has_result() const;
  void fail_unless_done(const std::string& what, const char* where);
  void show_part(train::Part part);
  void log_evaluation(const train::Evaluation& evaluation);
  std::string what_is_saved(const char* where) const;
  void check_fit() const;
  void follow_split(const soup::ModelFile& file);
  void warn_of_disk(std::uint64_t need);
  std::unique_ptr<train::Trainer> new_trainer();
  soup::Model result();  // all ranks take part
  /// Saves and measures the model. All ranks take part; the first one writes and reports.
  void finish();
  soup::Model save_model();
  std::vector<std::byte> encode(const soup::Model& model);
  struct Quality {  // what could be measured
    std::optional<train::Evaluation> test;
    std::optional<train::Evaluation> unrounded;       // of textures before they are rounded, with --measure-float
    std::optional<train::AlignedEvaluation> aligned;  // if poses of training views were corrected
    std::optional<train::TrainingFit> fit;
    std::vector<std::optional<double>> baked;  // PSNR of each test view as viewers without the MLP show it
  };
  Quality measure(const soup::Model& model);
  std::vector<std::optional<double>> measure_baked(const soup::Model& model);
  nlohmann::json about_ranks();
  nlohmann::json quality_json(const Quality& quality) const;
  nlohmann::json size_json(const soup::Model& model);
  nlohmann::json run_json() const;
  void report(const soup::Model& model, const Quality& quality, const nlohmann::json& ranks);
  void report_result(const soup::Model& model, const Quality& quality);
  bool corrects_poses() const;
  bool has_goal() const { return train::has_goal(settings_); }
  bool has_candidate() const;
  bool goal_met() const;
  /// Calls `work`, in which all ranks take part. One process alone notes its Error and goes on.
  template <typename Work>
  void measure_if_possible(Work&& work) {
    if (ranks_.size() > 1)
      work();
    else
      failures_.attempt(work);
  }

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
  std::optional<train::Start> start_;  // until trainer_ has it
  std::unique_ptr<train::Trainer> trainer_;
  std::unique_ptr<train::Simplifier> simplifier_;
  soup::ModelFileOptions file_options_;
  std::unique_ptr<ProgressBar> bar_;
  std::optional<std::uint64_t> saved_;  // step of the last checkpoint
  std::uint64_t first_step_ = 0;        // of this process
  bool stopped_ = false;                // by a signal, between the rounds of simplifying
  std::vector<std::byte> model_bytes_;  // of model.glb
  bool model_written_ = false;
  bool warned_of_disk_ = false;
  Failures failures_;  // after the last step
};

/// Runs it to an exit status: errors are printed after the program's name, and told in the window.
int run_guarded(const char* program, const CommandLine& options, viewer::Live* live);

}  // namespace trisoup
