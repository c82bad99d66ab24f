// The files that a training run leaves. Each is written under a temporary name and renamed.
#pragma once

#include <cstdint>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "scene/scene.h"
#include "train/evaluate.h"
#include "train/trainer.h"

namespace trisoup::train {

/// One row of evaluations.csv: the test views as training renders them, with float textures.
struct EvaluationRow {
  std::uint64_t step = 0;
  double seconds = 0, cpu_seconds = 0;  // of training so far (Trainer)
  std::uint32_t triangles = 0;
  ImageMetrics mean;
};

class RunFolder {
 public:
  /// Creates the folder, and clears it of what killed runs left half-written. Throws Error when that, or a file in it, cannot be written.
  explicit RunFolder(std::filesystem::path path);

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path model() const { return path_ / "model.glb"; }
  std::filesystem::path checkpoint() const { return path_ / "checkpoint.safetensors"; }

  /// Keeps the rows of train.csv and evaluations.csv up to a step: those after a checkpoint are trained again.
  void resume_log(std::uint64_t step);
  void log(const Progress& progress) { rows_.push_back(progress); }
  void write_log() const;

  /// Adds a row to evaluations.csv and writes it; one of the same step takes the place of that before.
  void log_evaluation(const EvaluationRow& row);

  void write_metrics(const nlohmann::json& metrics) const;
  /// Removes the pictures of a run before this one, which may have had other views.
  void clear_renders();
  /// renders/<name>.png: photograph on the left, rendering on the right. Views whose names would give the same file are numbered.
  void write_render(const scene::View& view, const std::vector<float>& colour);

 private:
  std::filesystem::path path_;
  std::vector<Progress> rows_;
  std::vector<EvaluationRow> evaluations_;
  std::set<std::string> renders_;  // written so far
};

}  // namespace trisoup::train
