// What changes as a training goes on: learning rates, texture levels, picture sizes, refinement, pruning. All follow
// from the settings and the number of completed steps.
#pragma once

#include <cstdint>

#include "train/config/settings.h"

namespace trisoup::train {

/// Vertex learning rates above these tear surfaces apart instead of moving them: real scenes, and synthetic ones, which
/// start from small random triangles (docs/decisions.md).
inline constexpr double kMaxVertexLr = 1e-2, kMaxVertexLrSynthetic = 5e-3;
/// The first vertex learning rate with which the rates of all steps sum to `travel`, normalised units; at most
/// `max_lr`. VectorAdam moves a vertex by about its learning rate in every step, whatever the gradient's length, so
/// `travel` is the distance that a vertex can go.
double vertex_lr(const Settings& settings, double travel, double max_lr = kMaxVertexLr);
/// Distance that a vertex can go in a published training, normalised units.
double published_travel(Recipe recipe);

/// Factor of a learning rate in step 1..steps: exponential decay to `end`. Each round after the last step (of
/// `round_steps`) goes through the end of the decay again.
double lr_factor(const Settings& settings, double end, std::uint64_t step);
/// Factor of the vertex learning rate, which falls to zero at the end of a training that starts from a surface.
double vertex_lr_factor(const Settings& settings, std::uint64_t step);

/// Weight of the depth loss in step 1..steps: falls linearly to 0. 0 after the last step.
double depth_weight(const Settings& settings, std::uint64_t step);

/// The only texture level of the coarse part.
inline constexpr std::uint32_t kCoarseLevel = 0;
/// Completed steps after which textures get their fine levels; 0: they have them from the start.
std::uint64_t coarse_end(const Settings& settings);

/// Sides of the smaller pictures of the first steps, as a share of the photographs'; 1: there are none.
double small_scale(const Settings& settings);
/// Completed steps after which steps look at the photographs at their own size; 0: all do.
std::uint64_t small_end(const Settings& settings);

/// Steps after which those begin that measure how far cameras must move, and after which the last correction is made.
std::uint64_t pose_begin(const Settings& settings);
std::uint64_t pose_end(const Settings& settings);
/// Whether poses are corrected after this many completed steps.
bool is_pose_correction(const Settings& settings, std::uint64_t step);

/// Sides of the pictures in which visible pixels are counted, as a share of the photographs'.
inline constexpr double kCountScale = 0.5;
/// Completed steps at which the only refinement happens if a training ends before `refine_every` but starts beyond its
/// budget; 0: none.
std::uint64_t only_refinement(const Settings& settings);
/// Whether triangles are refined after this many completed steps.
bool is_refinement(const Settings& settings, std::uint64_t step);
/// Whether that refinement is the last one.
bool is_last_refinement(const Settings& settings, std::uint64_t step);
/// Completed steps at which the soup is next pruned to its knee: the first after `step`; 0: never.
std::uint64_t next_pruning(const Settings& settings, std::uint64_t step);

/// Completed steps at which a training with `per_decade` evaluations in each ten-fold of steps is evaluated next: the
/// first after `step`, from step 10 on; 0: never.
std::uint64_t next_evaluation(std::uint32_t per_decade, std::uint64_t step);

/// How often a training is interrupted between steps, beside what its settings say; 0: never.
struct Intervals {
  std::uint64_t progress_every = 0;
  std::uint32_t evaluations_per_decade = 0;
  std::uint64_t most_steps = 0;  // without an interruption
};
/// The number of completed steps at which a training is next interrupted: to report, to change topology, to evaluate or
/// to save; at most `last`.
std::uint64_t next_event(const Settings& settings, const Intervals& intervals, std::uint64_t step, std::uint64_t last);
/// Whether the test views are evaluated after this many completed steps.
bool is_evaluation(const Settings& settings, const Intervals& intervals, std::uint64_t step);

/// The settings with which a training that has completed `step` steps continues to `steps`, if these are more. The
/// schedule becomes that of `steps`: learning rates rise, vertices move again, and refinement goes on up to its share
/// of `steps`. The coarse part and the smaller pictures do not come back.
Settings extended(Settings settings, std::uint64_t step, std::uint64_t steps);

}  // namespace trisoup::train
