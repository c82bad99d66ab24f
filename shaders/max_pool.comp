// A layer of LPIPS (Zhang et al. 2018): maxima of squares inside the picture.
#include "common/kernel.h"
#include "args/max_pool.h"

KERNEL(64, MaxPoolArgs) {
  const uint i = thread_index();
  if (i >= a.values) return;
  const uint x = i % a.result_width, row = i / a.result_width, y = row % a.result_height;
  const uint first = ((row / a.result_height) * a.height + y * a.stride) * a.width + x * a.stride;
  float most = a.from.v[first];
  for (uint j = 0u; j < a.size; ++j)
    for (uint k = 0u; k < a.size; ++k) most = max(most, a.from.v[first + j * a.width + k]);
  a.result.v[i] = most;
}
