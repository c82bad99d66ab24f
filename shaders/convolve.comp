// A layer of LPIPS (Zhang et al. 2018): direct convolution and ReLU. A thread computes 16 channels of one pixel.
#include "common/kernel.h"
#include "args/convolve.h"
#include "common/non_finite.h"

CONSTANT(0, bool, STRIDED, false);  // false: the stride is 1, and neighbouring threads read neighbouring values

KERNEL(64, ConvolveArgs) {
  const uint across = (a.result_width + 63u) / 64u, group = group_index(), thread = gl_LocalInvocationIndex;
  if (group >= across * a.result_height) return;
  const uint y = group / across, x = (group % across) * 64u + thread;
  if (x >= a.result_width) return;
  vec4 sum[4];
  UNROLL for (uint q = 0u; q < 4u; ++q) sum[q] = a.bias.v[q];
  for (uint channel = 0u; channel < a.channels; ++channel)
    for (uint j = 0u; j < a.size; ++j) {
      const uint row = y * a.stride + j - a.padding;  // wraps around above the picture
      if (row >= a.height) continue;
      for (uint i = 0u; i < a.size; ++i) {
        const uint column = (STRIDED ? x * a.stride : x) + i - a.padding;
        float value = 0.0f;
        if (column < a.width) value = a.from.v[(channel * a.height + row) * a.width + column];
        const uint at = 4u * ((channel * a.size + j) * a.size + i);
        UNROLL for (uint q = 0u; q < 4u; ++q) sum[q] += value * a.weights.v[at + q];
      }
    }
  bool finite = true;
  UNROLL for (uint q = 0u; q < 4u; ++q) UNROLL for (uint c = 0u; c < 4u; ++c) if (4u * q + c < a.result_channels) {
    finite = finite && is_finite(sum[q][c]);
    a.result.v[((4u * q + c) * a.result_height + y) * a.result_width + x] = max(sum[q][c], 0.0f);
  }
  if (!finite) atomicOr(a.overflow.v[0], 1u);
}
