// Parameters that are not numbers: where they were found, and what becomes of them.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "gpu/device.h"
#include "train/step/batch_buffers.h"
#include "train/step/soup_buffers.h"

namespace trisoup::train {

/// The first of its kind since the last look. Kernels reset what they find in the step in which they find it
/// (shaders/common/non_finite.h): a texel's logit or a weight becomes 0, its optimiser state starts anew. A triangle
/// with such a vertex is drawn by no view; it becomes a point, which the next change of topology that drops unseen
/// triangles drops.
struct NonFinite {
  enum class Kind { vertex, texel, weight };  // NON_FINITE_
  Kind kind = Kind::vertex;
  std::uint64_t step = 0;      // in which it was found, counted from 1
  std::uint32_t triangle = 0;  // of a vertex or texel
  std::uint32_t place = 0;     // 0..2: the vertex; sample of the triangle's texture, all levels; index of the weight
  std::uint32_t channel = 0;   // of a texel, 0..7
  std::uint64_t count = 0;     // triangles taken out, texels or weights reset; 0: only optimiser state was
};

/// One line for people.
std::string to_string(const NonFinite& fault);

/// What was found since the last call, at most one of each kind; takes the triangles out. Waits for the device.
std::vector<NonFinite> take_non_finite(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers);

}  // namespace trisoup::train
