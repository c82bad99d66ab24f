// What a training step costs, kernel by kernel, against what the device could do, and how that grows.
#pragma once

#include <cstdint>
#include <string>

#include "gpu/device.h"

namespace trisoup::bench {

struct StepsOptions {
  std::uint32_t side = 200, triangles = 2000, views = 4;  // pictures are side x side pixels
  std::uint32_t level_min = 2, level_max = 5;
  int repeats = 5;
  std::uint32_t most_pixels = 800, most_triangles = 60000;  // of the tables of growth: largest side, most triangles
  std::string json;                                         // file; empty: none
};

/// Prints milliseconds, bytes and operations per kernel of a step on a random soup, then how they grow. Bytes: every
/// value that a result needs read once, every result written once. Operations: the multiplications and additions of the
/// formulas as they are computed, without addresses, comparisons and conversions. The floor is the longer of the times
/// in which a copy moves these bytes and `arithmetic` makes these operations. Throws Error.
void steps(gpu::Device& gpu, const StepsOptions& options);

}  // namespace trisoup::bench
