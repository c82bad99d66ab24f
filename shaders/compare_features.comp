// The distance that LPIPS (Zhang et al. 2018) adds for a layer: features of a pixel have unit length over the channels.
#include "common/kernel.h"
#include "args/compare_features.h"
#include "common/fixed_point.h"
#include "common/non_finite.h"

ARGUMENTS(CompareFeaturesArgs)

SHARED float s_sum[64];

KERNEL_MAIN(64) {
  const uint i = thread_index(), thread = gl_LocalInvocationIndex;
  float distance = 0.0f;
  if (i < a.pixels) {
    float first = 0.0f, second = 0.0f;
    for (uint c = 0u; c < a.channels; ++c) {
      const float p = a.first.v[c * a.pixels + i], q = a.second.v[c * a.pixels + i];
      first += p * p;
      second += q * q;
    }
    if (!is_finite(first + second)) atomicOr(a.overflow.v[0], 1u);
    first = 1.0f / (sqrt(first) + 1e-10f);
    second = 1.0f / (sqrt(second) + 1e-10f);
    for (uint c = 0u; c < a.channels; ++c) {
      const float d = a.first.v[c * a.pixels + i] * first - a.second.v[c * a.pixels + i] * second;
      distance += a.weights.v[c] * d * d;
    }
  }
  s_sum[thread] = distance;
  barrier();
  if (thread == 0u) {
    for (uint k = 1u; k < 64u; ++k) distance += s_sum[k];
    distance *= 1.0f / IMAGE_SUM_UNIT;
    if (!usable(distance, kFixedLimit)) atomicOr(a.overflow.v[0], 1u);
    add_fixed(a.sums, 0u, a.sums, 1u, distance);
  }
}
