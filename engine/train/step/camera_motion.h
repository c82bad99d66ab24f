// How far cameras must move for their pictures to fit their photographs (shaders/common/camera_motion.h).
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "base/small_system.h"
#include "gpu/device.h"
#include "scene/pose_change.h"
#include "train/step/soup_buffers.h"

namespace trisoup::train {

/// Sums of measure_motion.comp on the device.
struct MotionSums {
  std::uint32_t views = 0;
  FixedSums sums;  // [views][8][4]
};
inline constexpr std::uint64_t kMotionBytes = 256;  // of a view
MotionSums allocate_motion_sums(gpu::Device& gpu, std::uint32_t views);

/// Normal equations of one camera: means over its pixels, for a change of its pose (turn, shift). Differences of colour
/// are in 0..1, turns in radians, shifts in normalised units.
struct MotionEquations {
  SquareMatrix<6> hessian{};         // of half the weighted mean square
  std::array<double, 6> gradient{};  // of it
  double slope = 0;                  // mean square of the picture's gradient, per pixel of the photograph
  double square = 0;                 // mean square of the difference, weighted
  bool seen = false;                 // whether a pixel counts
};

/// Reads the sums and sets them to zero. cameras: of the views, as they were rendered. Waits for the device.
std::vector<MotionEquations> take_equations(gpu::Device& gpu, const MotionSums& sums,
                                            std::span<const scene::Camera> cameras);

/// The change of pose that fits best, with a prior: all changes together are small. so_far: change that the camera
/// already has. Zero where no pixel counts.
scene::PoseChange best_change(const MotionEquations& equations, const scene::PoseChange& so_far);

/// How far a change moves the picture, root mean square over its edges, pixels of the photograph.
double pixels_moved(const MotionEquations& equations, const scene::PoseChange& change);

}  // namespace trisoup::train
