// Detects and resets non-finite parameters.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "gpu/device.h"
#include "train/step/batch_buffers.h"
#include "train/step/soup_buffers.h"

namespace trisoup::train {

/// The first non-finite parameter of its kind since the last call of take_non_finite(). Kernels reset them in the same
/// step (shaders/common/non_finite.h): a texel's logit or an MLP weight becomes 0 and its optimiser state starts anew.
/// A triangle with a non-finite vertex is not rendered. take_non_finite() collapses it to a point, and the next
/// refinement that drops invisible triangles drops it.
struct NonFinite {
  enum class Kind { vertex, texel, weight };  // NON_FINITE_
  Kind kind = Kind::vertex;
  std::uint64_t step = 0;      // the step that found it, counted from 1
  std::uint32_t triangle = 0;  // of a vertex or texel
  std::uint32_t place = 0;     // vertex 0..2; sample of the triangle's texture, over all levels; index of the weight
  std::uint32_t channel = 0;   // of a texel, 0..7
  std::uint64_t count = 0;     // triangles collapsed, texels or weights reset; 0: only optimiser state
};

/// A message of one line.
std::string to_string(const NonFinite& found);

/// Returns the findings since the last call, at most one of each kind, and collapses triangles with a non-finite
/// vertex. Waits for the device.
std::vector<NonFinite> take_non_finite(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers);

}  // namespace trisoup::train
