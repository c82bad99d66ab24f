// A training run: schedule, topology changes and the state that a checkpoint holds.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "format/safetensors.h"
#include "gpu/device.h"
#include "run/part_times.h"
#include "run/progress.h"
#include "scene/scene.h"
#include "train/config/schedule.h"
#include "train/config/settings.h"
#include "train/quality/evaluate.h"
#include "train/quality/training_fit.h"
#include "train/start/initial_triangles.h"
#include "train/step/batch_buffers.h"
#include "train/step/exposure.h"
#include "train/step/non_finite.h"
#include "train/step/pose_corrections.h"
#include "train/step/shared_soup.h"
#include "train/step/soup_buffers.h"
#include "train/step/step.h"
#include "train/step/step_queue.h"
#include "train/step/training_views.h"
#include "train/topology/importance.h"
#include "train/topology/refine.h"
#include "train/topology/simplify.h"

namespace trisoup::train {

class Trainer {
 public:
  /// Starts from the given triangles (3 vertices each, normalised coordinates). `scene` must outlive the trainer.
  /// ranks: those that share the soup (shared_soup.h), each with a trainer of the same scene, settings and start on a
  /// device of the same kind; null: this process alone. They make the same calls, in the same order: steps, evaluations
  /// and checkpoints all take part in, and what comes out is the same for all where nothing else is said. One rank's
  /// Callbacks::stop ends run() on all. All calls throw ranks::RankLost where another rank has ended.
  Trainer(gpu::Device& gpu, const scene::Scene& scene, const Settings& settings, const Start& start,
          ranks::Ranks* ranks = nullptr);

  /// Goes on from a checkpoint of the same scene and settings (checkpoint_info() tells them, extended() where there
  /// are to be more steps; how often something is written may differ). Throws Error when it is another's, damaged or
  /// cut short.
  Trainer(gpu::Device& gpu, const scene::Scene& scene, const Settings& settings,
          const std::filesystem::path& checkpoint, ranks::Ranks* ranks = nullptr);

  /// Goes on from a model of the same dataset, which `settings` have trained, as if its last step were done: for
  /// begin_round().
  Trainer(gpu::Device& gpu, const scene::Scene& scene, const Settings& settings, const soup::Model& model);

  /// A picture of a step, between its loss and the gradients that follow from it. Row 0 is at the top.
  struct StepPicture {
    const scene::View* view = nullptr;  // the training view
    int width = 0, height = 0;
    std::vector<float> colour;    // [height][width][3], in the exposure of the photograph
    std::vector<float> target;    // [height][width][3]
    std::vector<float> gradient;  // [height][width][3] dL/dcolour to be added where pixels are in the loss; or empty
  };

  struct Callbacks {
    std::function<void(const Progress&)> on_progress;  // about every progress_every steps
    std::function<void(std::uint64_t step)>
        on_checkpoint;                                    // every Settings::checkpoint_every steps, not after the last
    std::function<void(std::uint64_t step)> on_evaluate;  // every Settings::eval_every steps, not after the last
    std::function<void(const NonFinite&)> on_non_finite;  // a parameter was not a number and has been reset
    std::function<std::uint64_t(std::uint64_t step)> until;  // asked between steps, the device idle: the step to go on
                                                             // to before asking again; may wait
    std::uint64_t progress_every = 10;
    std::uint32_t evaluations_per_decade = 0;  // also evaluate after the steps of next_evaluation()
    const std::atomic<bool>* stop = nullptr;   // asks to end after the current step
    std::function<bool()> interrupted;         // the same; asked before each step
    /// Called for each view of each step; may fill StepPicture::gradient. Only of a process alone. If it throws, the
    /// step is not done.
    std::function<void(StepPicture&)> on_picture;
  };

  /// Trains until the last step, or until asked to stop.
  void run(const Callbacks& callbacks);

  /// Frees what only steps need of textures, for a model that is to be measured beside them. Nothing can be trained or
  /// saved after it.
  void end_training();

  bool finished() const { return step_ >= last_step(); }
  /// Settings::steps, and those of the rounds begun so far.
  std::uint64_t last_step() const { return settings_.steps + rounds_ * settings_.round_steps; }
  /// Of the triangles as they are now, in TrainingViews::sample_on_random_backgrounds().
  Importance importance();
  /// What is trained is again what it was in a checkpoint of this training; the steps so far stay counted. For
  /// begin_round() with something to take away, which begins the optimiser anew. One rank only. Throws Error where the
  /// file cannot be read.
  void go_back(const std::filesystem::path& checkpoint);
  /// Makes a finished training's soup smaller (train/topology/simplify.h); run() then trains it for
  /// Settings::round_steps steps more. Returns false, and begins nothing, where it is to be smaller and there is
  /// nothing that may go.
  bool begin_round(const Shares& shares);
  std::uint64_t step() const { return step_; }
  std::uint64_t photographs_fingerprint() const { return photographs_; }
  double seconds() const { return seconds_; }
  double cpu_seconds() const { return cpu_seconds_; }  // of all threads of the process, over the same time
  std::uint32_t triangles() const { return soup_.triangles; }
  /// What ranks divide (soup_buffers.h), of all of them.
  std::uint64_t texture_bytes() const { return train::texture_bytes(soup_.source_samples, soup_.lattice_samples); }
  const Settings& settings() const { return settings_; }
  /// Steps, topology and importance count in `times` from now on. It must outlive the trainer.
  void measure_into(PartTimes& times) { times_ = &times; }
  /// Whether the last resampling of this run found too few pixels in the training views to split up to the budget.
  bool out_of_pixels() const { return last_refinement_ == RefineOutcome::out_of_pixels; }

  /// note: any text, for CheckpointInfo::note. Of several ranks the first writes.
  void write_checkpoint(const std::filesystem::path& path, const std::string& note = {});
  /// Of several ranks the first has it; that of the others is empty but for its triangles.
  soup::Model model();
  Evaluation evaluate_float(const OnRender& on_render = {});
  /// Of the model as it is now, in TrainingViews::sample().
  TrainingFit training_fit();
  /// Of a model of it.
  TrainingFit training_fit(const soup::Model& model);
  /// What steps take for the exposure of each photograph, [training views]: gains (shaders/common/exposure.h) from the
  /// model's colours to the photograph's. Empty where Settings::exposure is off.
  std::vector<soup::ExposureGrid> exposures();
  /// Corrections of the training cameras; null where Settings::pose_corrections is off.
  const PoseCorrections* poses() const { return poses_ ? &*poses_ : nullptr; }

 private:
  /// The part of construction that all starts share. The soup stays empty.
  Trainer(gpu::Device& gpu, const scene::Scene& scene, const Settings& settings, ranks::Ranks* ranks);
  /// exposures: at the start, of the training views; empty: all 0.
  void prepare(std::span<const soup::ExposureGrid> exposures = {});
  /// Its triangles, textures and MLP with their moments. Those of exposures, once there is room for them (prepare()).
  void read_soup(const soup::Safetensors& file, const std::filesystem::path& path);
  void read_exposures(const soup::Safetensors& file);
  void read_poses(const soup::Safetensors& file);
  Intervals intervals(const Callbacks& callbacks) const;
  void train_until(std::uint64_t last, const Callbacks& callbacks);
  /// One step with exchanges between ranks. False if it is not done.
  bool train_together(const BatchLayout& batch, const Callbacks& callbacks);
  /// One step that shows its pictures to Callbacks::on_picture.
  void train_shown(const BatchLayout& batch, const Callbacks& callbacks);
  void show_pictures(const Callbacks& callbacks);
  bool asked_to_stop(const Callbacks& callbacks) const {
    return soup_.partition->can_replay()
               ? (callbacks.stop && *callbacks.stop) || (callbacks.interrupted && callbacks.interrupted())
               : soup_.partition->outcome() == SoupPartition::Outcome::stopped;
  }
  StepInputs step_inputs() const;
  void change_topology();
  void correct_poses();
  const MotionSums* measured_motion() const;
  bool refine_soup();            // false if no view shows a triangle
  std::vector<bool> backdrop();  // [T] whether a triangle is part of the backdrop
  kernels::StepState state_of(std::uint64_t step, const BatchLayout& batch) const;
  gpu::CommandList& commands_of(const BatchLayout& batch);
  const Exposures* given_exposures() const { return exposures_ ? &*exposures_ : nullptr; }
  double share_uncovered();
  Progress progress_since(std::uint64_t first, double seconds);

  gpu::Device& gpu_;
  const scene::Scene& scene_;
  Settings settings_;
  std::uint64_t photographs_;  // fingerprint
  PartTimes own_times_{gpu_};
  PartTimes* times_ = &own_times_;
  BatchBuffers buffers_;
  SoupBuffers soup_;
  gpu::Buffer eyes_;                      // positions of the training cameras, if learning rates depend on them
  ranks::Ranks* ranks_ = nullptr;         // null: this process alone
  std::optional<SharedSoup> shared_;      // where there are several
  std::optional<Exposures> exposures_;    // where settings ask for them
  std::optional<PoseCorrections> poses_;  // where settings ask for them
  std::optional<TrainingViews> views_;
  StepQueue queue_;
  /// A step's commands, by the sizes of its batch. They are recorded again when a buffer has moved.
  std::map<std::array<std::uint64_t, 5>, gpu::CommandList> commands_;
  std::uint64_t step_ = 0;    // completed steps
  std::uint64_t rounds_ = 0;  // begun after Settings::steps
  // Completed steps when the moments of textures, vertices and MLP were last zero.
  std::uint64_t texture_start_ = 0, vertex_start_ = 0, mlp_start_ = 0;
  RefineOutcome last_refinement_ = RefineOutcome::done;
  double uncovered_ = 0;  // of the last step before a report
  double seconds_ = 0, cpu_seconds_ = 0;
};

}  // namespace trisoup::train
