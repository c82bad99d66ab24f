// How often statistical tests draw.
#pragma once

#include "gpu/device.h"

namespace trisoup::test {

/// All of `full` draws on the CPU's own threads, a tenth through a driver (or an emulated device): a launch, watched by
/// the validation layers, costs a hundred times as much there, and kernels, hashes and fixed-point sums are the same. A
/// tenth under the sanitizers too, which look at memory. Tolerances follow from the standard error of the draws made.
inline int draws(const gpu::Device& device, int full) {
#ifdef TRISOUP_SANITIZED
  constexpr bool kSanitized = true;
#else
  constexpr bool kSanitized = false;
#endif
  return device.info().backend == "cpu" && !kSanitized ? full : full / 10;
}

}  // namespace trisoup::test
