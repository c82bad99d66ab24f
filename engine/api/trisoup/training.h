// Trains a model from a dataset.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "trisoup/dataset.h"
#include "trisoup/device.h"
#include "trisoup/model.h"

namespace trisoup {

struct TrainingOptions {
  std::string preset = "best";     // "fast", "balanced", "best" or "published"
  std::uint64_t steps = 0;         // schedules scale with the number of steps; 0: the preset's number
  std::uint32_t triangles = 0;     // maximum number; 0: the preset's number
  std::uint64_t seed = 0;          // the same seed on the same device gives the same model, bit for bit
  std::vector<std::string> set{};  // further settings as "name=value" (docs/settings.md)
};

/// Means over the training steps since the previous report.
struct TrainingProgress {
  std::uint64_t step = 0;  // completed steps
  std::uint32_t triangles = 0;
  double loss = 0;
  double seconds = 0;  // training time so far
};

class Training {
 public:
  /// The device must outlive the training. Throws if an option is invalid or the device has too little memory.
  Training(Device& device, const Dataset& dataset, const TrainingOptions& options = {});
  Training(Training&&) noexcept;
  Training& operator=(Training&&) noexcept;
  ~Training();

  /// Trains until the last step, or until `on_progress` returns false. `on_progress` is called about every `every`
  /// steps. Call run() again to continue.
  void run(const std::function<bool(const TrainingProgress&)>& on_progress = {}, std::uint64_t every = 10);
  bool finished() const;
  /// The model at the current step.
  Model model();

  struct Impl;

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace trisoup
