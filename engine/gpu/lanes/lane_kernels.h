// Kernels that run several invocations at once, one per SIMD lane (translate_spirv.py), in the widths that this program
// was built with.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "gpu/compiled_kernels.h"

namespace trisoup::gpu::host {

/// A set of kernels and its CPU requirements.
struct LaneKernels {
  std::uint32_t lanes;
  std::string instructions;  // name of the instruction set: "AVX2"
  bool usable;               // whether this CPU supports it
  std::vector<CompiledKernel> kernels;
};

/// Returns all sets, widest first. The last set has one lane and runs on every CPU (kernel_language.h). Only that set
/// has native variants of all kernels, including those used only by tests; wider sets fall back to it.
const std::vector<LaneKernels>& lane_kernels();

/// Returns the widest usable set. The environment variable TRISOUP_LANES selects another width, for tests and
/// measurements. Throws Error if there is no usable set of that width.
const LaneKernels& chosen_lane_kernels();

}  // namespace trisoup::gpu::host
