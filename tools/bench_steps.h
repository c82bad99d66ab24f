// soup-bench steps: time of a training step by kernel, compared with the limits of the device, and its growth.
#pragma once

#include <cstdint>
#include <string>

#include "gpu/device.h"

namespace trisoup::bench {

struct StepsOptions {
  std::uint32_t side = 200, triangles = 2000, views = 4;  // views have side x side pixels
  std::uint32_t level_min = 2, level_max = 5;
  int repeats = 5;
  std::uint32_t most_pixels = 800, most_triangles = 60000;  // limits of the growth tables: side, triangles
  std::string json;                                         // output file; empty: none
};

/// Prints milliseconds, bytes and operations per kernel of a training step on a random soup, then how the times grow.
/// Bytes: every input read once and every result written once. Operations: multiplications and additions of the
/// formulas, without addresses, comparisons and conversions. Floor: the longer of the times that a copy needs for these
/// bytes and the `arithmetic` kernel for these operations. Throws Error.
void steps(gpu::Device& gpu, const StepsOptions& options);

}  // namespace trisoup::bench
