// Offsets of the tiles' lists: exclusive sums of their counts, which go back to zero for the fill. One workgroup.
#include "common/kernel.h"
#include "args/bin.h"

SHARED uint s_sum[256];

KERNEL(256, BinArgs) {
  const uint thread = gl_LocalInvocationIndex;
  const uint share = (a.tiles + 255u) / 256u;
  const uint first = a.tile_first + min(thread * share, a.tiles), last = min(first + share, a.tile_first + a.tiles);
  uint sum = 0u;
  for (uint i = first; i < last; ++i) sum += a.counts.v[i];
  s_sum[thread] = sum;
  barrier();
  for (uint step = 1u; step < 256u; step *= 2u) {
    const uint before = thread >= step ? s_sum[thread - step] : 0u;
    barrier();
    s_sum[thread] += before;
    barrier();
  }
  uint offset = thread > 0u ? s_sum[thread - 1u] : 0u;
  for (uint i = first; i < last; ++i) {
    a.offsets.v[i] = offset;
    offset += a.counts.v[i];
    a.counts.v[i] = 0u;
  }
  if (thread == 255u) {
    const uint total = s_sum[255];
    a.offsets.v[a.tile_first + a.tiles] = total;
    a.control.v[0].list_total = total;
    a.control.v[0].list_peak = max(a.control.v[0].list_peak, total);
    if (total > a.capacity && a.control.v[0].overflow == 0u) {
      a.control.v[0].overflow = 1u;
      a.control.v[0].overflow_step = a.state.v[0].step;
    }
  }
}
