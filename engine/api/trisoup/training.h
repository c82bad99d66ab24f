// Trains a model from a dataset.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "trisoup/dataset.h"
#include "trisoup/device.h"
#include "trisoup/interruption.h"
#include "trisoup/model.h"

namespace trisoup {

struct TrainingOptions {
  std::string preset = "best";     // "fast", "balanced", "best" or "published"
  std::uint64_t steps = 0;         // schedules scale with the number of steps; 0: the preset's number
  std::uint32_t triangles = 0;     // maximum number; 0: the preset's number
  std::uint64_t seed = 0;          // the same seed on the same device gives the same model, bit for bit
  std::vector<std::string> set{};  // further settings as "name=value" (docs/settings.md)
  /// First triangles, [triangles][3][3], the dataset's coordinates; empty: the setting `init` decides.
  std::vector<double> start_vertices{};
  std::vector<float> start_colours{};  // of their vertices, [triangles][3][3], 0 to 1; empty: grey
  Interruption interrupted{};          // of the constructor, which then throws Interrupted
};

/// Means over the training steps since the previous report.
struct TrainingProgress {
  std::uint64_t step = 0;  // completed steps
  std::uint32_t triangles = 0;
  double loss = 0;
  double seconds = 0;            // training time so far
  std::uint64_t last_step = 0;   // of the training
  std::optional<double> psnr{};  // of training views, dB; none if no pixel of them is in the loss
  double ms_per_step = 0;
  double cpu_seconds = 0;  // of all threads of the process, over the training time
};

/// A picture of a training step. Row 0 is at the top.
struct StepPicture {
  std::string view;           // name of the training view
  int width = 0, height = 0;  // smaller than the photograph in the steps that train on smaller pictures
  std::vector<float> colour;  // [height][width][3], in the exposure of the photograph
  std::vector<float> target;  // [height][width][3], the photograph on the background of the step
  /// [height][width][3], 0 at first: dL/dcolour of a further loss, which is added where pixels are in the loss. The
  /// trainer's own loss is a mean over all pixels of the step's views. Opacities learn from the latter only.
  std::vector<float> gradient;
};

struct TrainingCallbacks {
  /// Called about every `every` steps. Returns false to stop.
  std::function<bool(const TrainingProgress&)> on_progress{};
  std::uint64_t every = 10;
  Interruption interrupted{};  // asked between steps; run() then returns
  /// Called for each view of each step. Costs a download and an upload per step.
  std::function<void(StepPicture&)> image_loss{};
};

class Training {
 public:
  /// Throws if an option is invalid or the device has too little memory. Goals and validation views are for
  /// soup-train.
  Training(const Device& device, const Dataset& dataset, const TrainingOptions& options = {});
  /// Goes on from a checkpoint of the same dataset. Throws if it is damaged or belongs to another dataset.
  static Training resume(const Device& device, const Dataset& dataset, const std::filesystem::path& checkpoint);
  Training(Training&&) noexcept;
  Training& operator=(Training&&) noexcept;
  ~Training();

  /// Trains until the last step, or until `on_progress` returns false. `on_progress` is called about every `every`
  /// steps. Call run() again to continue.
  void run(const std::function<bool(const TrainingProgress&)>& on_progress = {}, std::uint64_t every = 10);
  /// The same with all callbacks. Exceptions of callbacks pass through; the step of `image_loss` is then not done.
  /// Throws if a callback calls it.
  void run(const TrainingCallbacks& callbacks);
  bool finished() const;
  std::uint64_t step() const;       // completed steps
  std::uint64_t last_step() const;  // number of steps
  std::uint32_t triangles() const;
  std::string settings() const;  // all of them, JSON
  /// What went wrong without ending the training, one line each.
  const std::vector<std::string>& warnings() const;
  const Device& device() const;
  const Dataset& dataset() const;
  /// Writes a checkpoint atomically. Throws if it cannot be written.
  void write_checkpoint(const std::filesystem::path& path) const;
  /// The model at the current step.
  Model model() const;
  /// Quality on the test views at the current step, before textures are rounded. Throws if there are none.
  Evaluation evaluate() const;

  struct Impl;

 private:
  explicit Training(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace trisoup
