// Output folder of a training. Files appear under their names only when they are complete; the two CSV logs grow by
// complete lines.
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

/// One row of evaluations.csv: quality on the test views, rendered as in training, with unrounded textures.
struct EvaluationRow {
  std::uint64_t step = 0;
  double seconds = 0, cpu_seconds = 0;  // training time so far
  std::uint32_t triangles = 0;
  ImageMetrics mean;
};

/// How to treat a training that the folder already contains.
enum class Earlier { refuse, overwrite, resume };

class RunFolder {
 public:
  /// Locks the folder if it exists, until this object or the process ends, and writes nothing else. Throws Error if
  /// - the folder cannot be created or written to: it is a file, or no permission, or a read-only disk,
  /// - another process is training into the folder (FolderLock),
  /// - `earlier` is refuse and the folder contains a training, finished or not,
  /// - `earlier` is resume and the folder contains a model without a checkpoint.
  RunFolder(std::filesystem::path path, Earlier earlier);

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path model() const { return path_ / "model.glb"; }
  /// The best model so far while a training is simplified. accept_candidate() renames it to model().
  std::filesystem::path candidate() const { return path_ / "candidate.glb"; }
  /// Checkpoint after one round of simplification, so that a later round can return to it. Exists until
  /// accept_candidate().
  std::filesystem::path state_of_round(std::size_t round) const { return state_of_round(path_, round); }
  static std::filesystem::path state_of_round(const std::filesystem::path& folder, std::size_t round);
  std::filesystem::path checkpoint() const { return path_ / "checkpoint.safetensors"; }
  /// Whether the training continues from a checkpoint.
  bool resumes() const { return resumes_; }

  /// Creates and locks the folder, and removes partial files of killed processes. Throws Error if the folder cannot be
  /// created or written to.
  void create();
  /// Removes all files of an earlier training and starts the logs. Call before the first step of a new training.
  void begin();
  /// Removes log rows after `step`, whose steps are trained again. Unless `finished`, also removes model, metrics and
  /// renders. Call before a training continues after `step`.
  void go_on(std::uint64_t step, bool finished);

  /// Adds a row to train.csv.
  void log(const Progress& progress);
  /// Adds a row to evaluations.csv, or replaces the last one if it has the same step.
  void log_evaluation(const EvaluationRow& row);
  /// Makes the logs survive a power failure, as checkpoints do.
  void flush_logs() const;

  /// Renames model() back to candidate(), unless a candidate exists. Call before more rounds of simplification.
  void take_model_back() const;
  /// Removes the checkpoints of all other rounds.
  void keep_state_of(std::size_t round) const;
  /// Renames the candidate, if there is one, to model() and removes the checkpoints of all rounds.
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
