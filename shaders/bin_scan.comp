// Offsets of the tiles' lists: exclusive prefix sums of their counts. Each workgroup handles BIN_SCAN_TILES tiles and
// sums all counts before them itself, which takes less time than a second launch.
#include "common/kernel.h"
#include "args/bin.h"

const uint kTilesPerThread = BIN_SCAN_TILES / 256u;

SHARED uvec2 s_sum[256];  // sum of a thread's tiles; sum of its share of the tiles before the workgroup's

KERNEL(256, BinArgs) {
  const uint thread = gl_LocalInvocationIndex, chunk = group_index() * BIN_SCAN_TILES;
  if (chunk >= a.tiles) return;
  const uint first = min(chunk + thread * kTilesPerThread, a.tiles), last = min(first + kTilesPerThread, a.tiles);
  uvec2 sum = uvec2(0u);
  for (uint i = first; i < last; ++i) sum.x += a.counts.v[a.tile_first + i];
  for (uint i = thread; i < chunk; i += 256u) sum.y += a.counts.v[a.tile_first + i];
  s_sum[thread] = sum;
  barrier();
  for (uint step = 1u; step < 256u; step *= 2u) {
    const uvec2 before = thread >= step ? s_sum[thread - step] : uvec2(0u);
    barrier();
    s_sum[thread] += before;
    barrier();
  }
  uint offset = s_sum[255].y + s_sum[thread].x - sum.x;
  for (uint i = first; i < last; ++i) {
    a.offsets.v[a.tile_first + i] = offset;
    offset += a.counts.v[a.tile_first + i];
  }
  if (thread == 255u && chunk + BIN_SCAN_TILES >= a.tiles) {
    const uint total = s_sum[255].x + s_sum[255].y;
    a.offsets.v[a.tile_first + a.tiles] = total;
    a.control.v[0].list_total = total;
    a.control.v[0].list_peak = max(a.control.v[0].list_peak, total);
    if (total > a.capacity && a.control.v[0].overflow == 0u) {
      a.control.v[0].overflow = 1u;
      a.control.v[0].overflow_step = a.state.v[0].step;
    }
  }
}
