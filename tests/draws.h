// How often statistical tests draw.
#pragma once

#include "gpu/device.h"

namespace trisoup::test {

/// All of `full` draws on the CPU's own threads, a tenth through a driver (or an emulated device): a launch, watched by the validation layers, costs a
/// hundred times as much there, and kernels, hashes and fixed-point sums are the same. Tolerances follow from the standard error of the draws made.
inline int draws(const gpu::Device& device, int full) { return device.info().backend == "cpu" ? full : full / 10; }

}  // namespace trisoup::test
