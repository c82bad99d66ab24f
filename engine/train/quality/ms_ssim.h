// MS-SSIM, computed on the device (Wang, Simoncelli and Bovik 2003, "Multiscale structural similarity for image quality
// assessment").
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "gpu/device.h"

namespace trisoup::train {

class MsSsim {
 public:
  static constexpr std::array<double, 5> kWeights{0.0448, 0.2856, 0.3001, 0.2363,
                                                  0.1333};  // of the scales, as published
  /// Shortest side with one window of 11 pixels in the last scale, as other implementations demand.
  static constexpr std::uint32_t kShortestSide = 10 * 16 + 1;

  explicit MsSsim(gpu::Device& gpu);

  /// Mean of the three channels; nothing if a side is shorter than kShortestSide. Pixels outside the mask are black in
  /// both pictures. Negative means of a scale count as 0. Arguments as of Flip::measure(), but colour is not clamped.
  /// Waits for the device.
  std::optional<double> measure(gpu::Address colour, gpu::Address target, std::uint32_t width, std::uint32_t height);

 private:
  gpu::Device& gpu_;
  gpu::Buffer scales_, sums_;
};

}  // namespace trisoup::train
