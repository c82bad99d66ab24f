// The files that a training run leaves. Each is whole under its name; the two logs grow by whole lines.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "run/folder_lock.h"
#include "run/growing_csv.h"
#include "run/renders.h"
#include "run/trainer.h"
#include "train/quality/evaluate.h"

namespace trisoup::train {

/// One row of evaluations.csv: the test views as training renders them, with float textures.
struct EvaluationRow {
  std::uint64_t step = 0;
  double seconds = 0, cpu_seconds = 0;  // of training so far (Trainer)
  std::uint32_t triangles = 0;
  ImageMetrics mean;
};

/// What is to happen to a training that the folder holds already.
enum class Earlier { refuse, overwrite, resume };

class RunFolder {
 public:
  /// Looks at the folder and, where it is there, locks it until the end of this object or of the process. Nothing else
  /// is written. Throws Error where another process trains into it (FolderLock), where it holds a training, finished or
  /// begun, and `earlier` is refuse, and where it holds a model without a checkpoint and `earlier` is resume.
  RunFolder(std::filesystem::path path, Earlier earlier);

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path model() const { return path_ / "model.glb"; }
  /// The best model of a training that is being simplified, until it becomes model().
  std::filesystem::path candidate() const { return path_ / "candidate.glb"; }
  /// The state of a training that is being simplified after one of its rounds, to go back to, until there is model().
  std::filesystem::path state_of_round(std::size_t round) const { return state_of_round(path_, round); }
  static std::filesystem::path state_of_round(const std::filesystem::path& folder, std::size_t round);
  std::filesystem::path checkpoint() const { return path_ / "checkpoint.safetensors"; }
  /// Whether there is a checkpoint to go on from.
  bool resumes() const { return resumes_; }

  /// Creates the folder, locks it, and clears it of what killed runs left half-written. Throws Error when that, or a
  /// file in it, cannot be written.
  void create();
  /// Steps are about to begin: takes away what an earlier training left, so that nothing of it stands beside what this
  /// one writes, and begins the logs.
  void begin();
  /// The same where a training goes on after a step. Rows of later steps are trained again, so they go; and so do
  /// model, metrics and renders where steps are still to come.
  void go_on(std::uint64_t step, bool finished);

  /// Adds a row to train.csv.
  void log(const Progress& progress);
  /// Adds a row to evaluations.csv; one of the same step takes the place of that before.
  void log_evaluation(const EvaluationRow& row);
  /// What the logs hold survives a power cut, as a checkpoint does.
  void flush_logs() const;

  /// Rounds are still to come: what was the model is the best one so far again, unless there is a better one.
  void take_model_back() const;
  /// Removes the states of other rounds.
  void keep_state_of(std::size_t round) const;
  /// Makes the candidate the model, if there is one, and removes the states of rounds.
  void accept_candidate() const;
  void write_metrics(const nlohmann::json& metrics) const;
  Renders& renders() { return renders_; }

 private:
  void look() const;
  void remove_results();
  std::vector<std::filesystem::path> states_of_rounds() const;

  std::filesystem::path path_;
  Earlier earlier_;
  bool resumes_ = false;
  std::unique_ptr<FolderLock> lock_;
  GrowingCsv training_, evaluations_;
  Renders renders_;
};

}  // namespace trisoup::train
