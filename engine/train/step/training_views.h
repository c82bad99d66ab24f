// The training views: which of them a step looks at, in which size, and where it samples them.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "gpu/device.h"
#include "scene/scene.h"
#include "train/config/settings.h"
#include "train/step/batch_view.h"
#include "train/step/neighbour_eyes.h"
#include "train/step/photographs.h"
#include "train/step/small_views.h"

namespace trisoup::train {

class TrainingViews {
 public:
  /// Uploads the photographs and depth maps of `scene`, and the smaller ones that steps after `step` use. `scene` and
  /// `settings` must outlive it. Throws gpu::OutOfMemory.
  TrainingViews(gpu::Device& gpu, const scene::Scene& scene, const Settings& settings, std::uint64_t step);

  /// The views of the step after `step` completed ones, sampled off the centres of pixels by a random distance, and
  /// some shaded from the eye of a neighbour. Views are drawn without replacement; batches run on from one epoch into
  /// the next. The same for the same seed and step.
  std::vector<BatchView> batch(std::uint64_t step);
  /// Whether that batch has a pixel inside a loss mask.
  bool has_pixels(std::uint64_t step);

  /// All views at their own size.
  const std::vector<BatchView>& full() const { return full_; }
  /// All views at the size in which visible pixels are counted.
  const std::vector<BatchView>& half() const { return half_; }
  /// Up to 64 views, spread evenly: enough to measure a soup.
  std::vector<BatchView> sample() const;
  /// The same, on random backgrounds if steps see any: triangles that only imitate the background are worth nothing.
  std::vector<BatchView> sample_on_random_backgrounds() const;

  /// Whether a view has a depth map and the settings use it.
  bool has_depths() const { return !depths_.pools.empty(); }

  /// Moves all views to these cameras, of the same pictures. cameras: in the order of Scene::train.
  void look_from(std::span<const scene::Camera> cameras);

  /// Frees the smaller photographs if no step after `step` uses them.
  void free_small(std::uint64_t step);
  /// Pixels of an average step from `step` to `last`, as a multiple of those of the next step.
  double pace(std::uint64_t step, std::uint64_t last) const;

 private:
  std::vector<std::uint32_t> draw(std::uint64_t step);
  void add_depth(const scene::View& view, BatchView& batch) const;
  bool uses_small(std::uint64_t step) const;

  const Settings& settings_;
  const double background_share_;  // of views on random backgrounds
  Photographs photographs_, depths_;
  std::vector<BatchView> full_, half_;
  std::vector<Neighbours> neighbours_;  // of full_; none: views are shaded from their own eyes
  std::optional<SmallViews> small_;
  std::vector<bool> masked_out_;  // views without a pixel inside the loss mask
  std::uint64_t epoch_ = ~0ull;   // of order_
  std::vector<std::uint32_t> order_;
};

}  // namespace trisoup::train
