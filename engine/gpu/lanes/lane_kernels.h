// Kernels that run several invocations at once, a lane for each (translate_spirv.py), in the widths that this program
// was built with.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "gpu/compiled_kernels.h"

namespace trisoup::gpu::host {

/// A set of kernels and what it asks of a CPU.
struct LaneKernels {
  std::uint32_t lanes;
  std::string instructions;  // as people call them: "AVX2"
  bool usable;               // by this CPU
  std::vector<CompiledKernel> kernels;
};

/// Widest first; the last ones are those of one lane, which every CPU can run (kernel_language.h) and which alone have
/// the variants that only tests ask for.
const std::vector<LaneKernels>& lane_kernels();

/// The widest usable set, or, for tests and measurements, that of as many lanes as the environment variable
/// TRISOUP_LANES says. Throws Error where there is none such.
const LaneKernels& chosen_lane_kernels();

}  // namespace trisoup::gpu::host
