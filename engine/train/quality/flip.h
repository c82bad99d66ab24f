// FLIP for pictures of low dynamic range, computed on the device (Andersson et al. 2020, "FLIP: A Difference Evaluator
// for Alternating Images"): the difference that people see when they flip between rendering and photograph.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "gpu/device.h"

namespace trisoup::train {

class Flip {
 public:
  /// Pixels per degree of a person 0.7 m in front of a monitor 0.7 m and 3840 pixels wide, as published.
  static constexpr double kPixelsPerDegree = 67;
  static constexpr double kFewest = 1, kMost = 400;

  /// Throws Error if pixels_per_degree is not between kFewest and kMost.
  explicit Flip(gpu::Device& gpu, double pixels_per_degree = kPixelsPerDegree);

  /// Mean error over the pixels inside the mask, 0..1; nothing if there are none. Pixels outside are black in both
  /// pictures. Waits for the device.
  /// colour: device address of the rendering, float [height][width][3], clamped to 0..1. target: of the photograph,
  /// RGBA8 [height][width], alpha is the mask.
  std::optional<double> measure(gpu::Address colour, gpu::Address target, std::uint32_t width, std::uint32_t height);

  /// Errors of the last measurement, 0..1, [height][width]; 0 outside the mask.
  std::vector<float> error_map();

  std::uint32_t most_pixels = 1 << 20;  // filtered at once, whatever the size of the picture; tests use less

 private:
  gpu::Device& gpu_;
  std::uint32_t radius_ = 0;
  double blue_share_ = 0;
  std::size_t pixels_ = 0;  // of the last picture
  gpu::Buffer taps_, rows_, errors_, sums_;
};

}  // namespace trisoup::train
