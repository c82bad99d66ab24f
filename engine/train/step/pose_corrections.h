// Small corrections of the training cameras' poses, which are learnt with the soup (docs/method.md, "Poses").
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "gpu/device.h"
#include "scene/pose_change.h"
#include "scene/scene.h"
#include "train/step/camera_motion.h"

namespace trisoup::train {

class PoseCorrections {
 public:
  enum class State : std::uint32_t {
    undecided,  // no correction was made yet
    used,
    unused  // the first corrections were too small to pay
  };

  /// views: the training views, in normalised coordinates. They must outlive this object. No pose is corrected yet.
  PoseCorrections(gpu::Device& gpu, const std::vector<scene::View>& views);

  /// Corrects all cameras by what steps have added to sums() since the last correction, but for what all have in common
  /// (scene/pose_change.h), and sets the sums to zero. The first time it does nothing, and never again does, if the
  /// median picture would move by less than `least` pixels. Returns whether cameras have moved.
  bool correct(double least);

  /// What steps add to; null if nothing will be corrected any more.
  const MotionSums* sums() const { return state_ == State::unused ? nullptr : &sums_; }
  /// The cameras as corrected, of all views.
  std::vector<scene::Camera> cameras() const;
  const std::vector<scene::PoseChange>& changes() const { return changes_; }
  State state() const { return state_; }
  /// How far the first correction moved, or would have moved, the median picture, pixels of its photograph; 0 before.
  double first_motion() const { return first_motion_; }

  /// All that a checkpoint holds beside the sums. [6 views + 2]
  std::vector<double> values() const;
  /// Takes what values() of an object with as many views has returned.
  void take(std::span<const double> values);

 private:
  gpu::Device& gpu_;
  const std::vector<scene::View>& views_;
  MotionSums sums_;
  std::vector<scene::PoseChange> changes_;
  State state_ = State::undecided;
  double first_motion_ = 0;
};

/// Summary of corrections.
struct PoseReport {
  double median_degrees = 0, largest_degrees = 0;
  double median_shift = 0, largest_shift = 0;  // share of the cameras' mean distance from the scene's centre
  std::string worst;                           // the photograph with the largest one
};
PoseReport report_of(const std::vector<scene::View>& views, std::span<const scene::PoseChange> changes);

}  // namespace trisoup::train
