// From a dataset to a model.
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
  std::uint64_t steps = 0;         // schedules scale with them; 0: the preset's
  std::uint32_t triangles = 0;     // budget; 0: the preset's
  std::uint64_t seed = 0;          // same seed, same device: the same model, bit for bit
  std::vector<std::string> set{};  // "name=value" of any setting (docs/settings.md)
};

/// Means over the steps since the report before, of training views.
struct TrainingProgress {
  std::uint64_t step = 0;  // completed
  std::uint32_t triangles = 0;
  double loss = 0;
  double seconds = 0;  // of training so far
};

class Training {
 public:
  /// The device must outlive the training. Throws where options cannot be, or memory does not suffice.
  Training(Device& device, const Dataset& dataset, const TrainingOptions& options = {});
  Training(Training&&) noexcept;
  Training& operator=(Training&&) noexcept;
  ~Training();

  /// Trains until the last step, or until `on_progress`, called about every `every` steps, returns false. It may be
  /// called again to go on.
  void run(const std::function<bool(const TrainingProgress&)>& on_progress = {}, std::uint64_t every = 10);
  bool finished() const;
  /// As it is now.
  Model model();

  struct Impl;

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace trisoup
