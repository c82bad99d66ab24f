#include "train/config/schedule.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace trisoup::train {
namespace {

/// Last share of the steps, in which vertices come to rest. Vertices that have found their place would open cracks.
double rest_share(const Settings& s) { return starts_from_surface(s) ? 0.2 : 0.0; }

/// Linear factor of the vertex learning rate at a share t of all steps.
double rest_factor(const Settings& s, double t) {
  const double share = rest_share(s);
  return share > 0 ? std::min(1.0, (1 - t) / share) : 1.0;
}

/// Progress of the schedule after `step` steps, 0..1. Each round after the last step goes through its end once more.
double progress(const Settings& s, double step) {
  constexpr double kAgain = 0.3;
  const auto steps = static_cast<double>(s.steps), round = static_cast<double>(s.round_steps);
  if (step <= steps || s.round_steps == 0) return step / steps;
  const double done = std::fmod(step - steps, round);
  return 1 - kAgain * (1 - (done == 0 ? 1 : done / round));
}

/// Shares of the steps after which the soup is pruned. The remaining steps repair what pruning has cost.
constexpr std::array kPrunings = {0.7, 0.8, 0.9};

/// Last step that may refine up to the budget. Refinement after the first pruning would fill what that has emptied.
double last_refinement(const Settings& s) {
  const auto steps = static_cast<double>(s.steps);
  return s.knee > 0 ? std::min(s.refine_until * steps, kPrunings.front() * steps - 1) : s.refine_until * steps + 1e-9;
}

std::uint64_t steps_of_share(const Settings& s, double share) {
  return static_cast<std::uint64_t>(std::llround(share * static_cast<double>(s.steps)));
}

}  // namespace

double vertex_lr(const Settings& s, double travel, double max_lr) {
  const double end = s.lr_vertex_end;
  if (!(end > 0)) return max_lr;  // check() refuses it
  // Mean factor over all steps: of end^t alone, or with the factor that brings vertices to rest.
  double mean = end == 1 ? 1.0 : (1 - end) / -std::log(end);
  if (rest_share(s) > 0) {
    constexpr int kParts = 1000;
    mean = 0;
    for (int i = 0; i < kParts; ++i) {
      const double t = (i + 0.5) / kParts;
      mean += std::pow(end, t) * rest_factor(s, t) / kParts;
    }
  }
  return std::min(travel / (mean * static_cast<double>(std::max<std::uint64_t>(s.steps, 1))), max_lr);
}

double published_travel(Recipe recipe) { return recipe == Recipe::synthetic ? 0.537 : 5.37; }

double lr_factor(const Settings& s, double end, std::uint64_t step) {
  return std::pow(end, progress(s, static_cast<double>(step)));
}

double vertex_lr_factor(const Settings& s, std::uint64_t step) {
  return lr_factor(s, s.lr_vertex_end, step) * rest_factor(s, progress(s, static_cast<double>(step) - 0.5));
}

double depth_weight(const Settings& s, std::uint64_t step) {
  const double end = s.depth_until * static_cast<double>(s.steps), done = static_cast<double>(step) - 1;
  return done < end ? s.lambda_depth * (1 - done / end) : 0;
}

std::uint64_t coarse_end(const Settings& s) { return steps_of_share(s, s.coarse_share); }

double small_scale(const Settings& s) { return s.published ? 1.0 : 0.5; }

std::uint64_t small_end(const Settings& s) { return std::max(coarse_end(s), steps_of_share(s, s.small_share)); }

std::uint64_t pose_begin(const Settings& s) { return coarse_end(s); }

std::uint64_t pose_end(const Settings& s) {
  constexpr double kEnd = 0.8;  // share of the steps; the rest fits the soup to the last poses
  const std::uint64_t end = steps_of_share(s, kEnd), begin = pose_begin(s);
  if (!s.pose_corrections || s.pose_every == 0 || end < begin) return begin;
  return begin + (end - begin) / s.pose_every * s.pose_every;
}

bool is_pose_correction(const Settings& s, std::uint64_t step) {
  return step > pose_begin(s) && step <= pose_end(s) && (step - pose_begin(s)) % s.pose_every == 0;
}

std::uint64_t only_refinement(const Settings& s) {
  const double until = last_refinement(s);
  const bool too_short =
      s.refine_every > 0 && (static_cast<double>(s.refine_every) > until || s.refine_every >= s.steps);
  // The second half of the steps repairs what it has cost.
  return too_short && s.init_count > s.triangles ? static_cast<std::uint64_t>(until / 2) : 0;
}

bool is_refinement(const Settings& s, std::uint64_t step) {
  if (s.refine_every == 0 || step == 0 || step >= s.steps) return false;
  return step == only_refinement(s) || (step % s.refine_every == 0 && static_cast<double>(step) <= last_refinement(s));
}

bool is_last_refinement(const Settings& s, std::uint64_t step) {
  return is_refinement(s, step) && !is_refinement(s, step + s.refine_every);
}

std::uint64_t next_pruning(const Settings& s, std::uint64_t step) {
  if (s.knee <= 0) return 0;
  // The importance of fine levels can be measured only after they exist.
  for (const double share : kPrunings)
    if (const std::uint64_t at = steps_of_share(s, share); at > step && at > coarse_end(s) && at < s.steps) return at;
  return 0;
}

std::uint64_t next_evaluation(std::uint32_t per_decade, std::uint64_t step) {
  if (per_decade == 0) return 0;
  // Two of them may round to the same step.
  for (std::uint32_t i = 0;; ++i)
    if (const auto at = static_cast<std::uint64_t>(std::llround(std::pow(10.0, 1.0 + double(i) / per_decade)));
        at > step)
      return at;
}

std::uint64_t next_event(const Settings& s, const Intervals& intervals, std::uint64_t step, std::uint64_t last) {
  std::uint64_t next = last;
  const auto at = [&](std::uint64_t event) {
    if (event > step) next = std::min(next, event);
  };
  const auto every = [&](std::uint64_t n) {
    if (n > 0) at((step / n + 1) * n);
  };
  every(intervals.progress_every);
  every(s.refine_every);
  every(s.eval_every);
  every(s.checkpoint_every);
  at(only_refinement(s));
  at(next_pruning(s, step));
  at(next_evaluation(intervals.evaluations_per_decade, step));
  at(coarse_end(s));
  if (pose_end(s) > pose_begin(s)) {
    at(pose_begin(s));
    const std::uint64_t done = step > pose_begin(s) ? (step - pose_begin(s)) / s.pose_every : 0;
    at(std::min(pose_begin(s) + (done + 1) * s.pose_every, pose_end(s)));
  }
  at(small_end(s));
  if (intervals.most_steps > 0) at(step + intervals.most_steps);
  return next;
}

bool is_evaluation(const Settings& s, const Intervals& intervals, std::uint64_t step) {
  if (s.eval_every > 0 && step % s.eval_every == 0) return true;
  return intervals.evaluations_per_decade > 0 && step > 0 &&
         next_evaluation(intervals.evaluations_per_decade, step - 1) == step;
}

Settings extended(Settings s, std::uint64_t step, std::uint64_t steps) {
  if (steps <= s.steps) return s;
  const auto share_of = [&](std::uint64_t then) { return static_cast<double>(then) / static_cast<double>(steps); };
  const std::uint64_t coarse = coarse_end(s), small = small_end(s);
  if (step >= coarse) s.coarse_share = share_of(coarse);
  if (step >= small && s.small_share > 0) s.small_share = share_of(small);
  s.steps = steps;
  return s;
}

}  // namespace trisoup::train
