// FLIP (Andersson et al. 2020): converts rendering and photograph to opponent colours and filters their rows. Pixels
// beyond the picture repeat its edge.
#include "common/kernel.h"
#include "args/flip_rows.h"
#include "common/photograph.h"
#include "common/powers.h"
#include "common/flip.h"

ARGUMENTS(FlipRowsArgs)

const uint kSpan = 192u;  // 64 pixels and twice FLIP_MOST_RADIUS

SHARED float s_opponent[6 * 192];

FN void load(TAKES_ARGUMENTS uint index, uint slot) {
  const uint rgba = a.target.v[index];
  const bool counts = in_mask(rgba);
  vec3 shown = vec3(0.0f), wanted = vec3(0.0f);
  if (counts) {
    shown = clamp(vec3(a.colour.v[index * 3u], a.colour.v[index * 3u + 1u], a.colour.v[index * 3u + 2u]), vec3(0.0f),
                  vec3(1.0f));
    wanted = vec3(float(rgba & 255u), float((rgba >> 8) & 255u), float((rgba >> 16) & 255u)) * vec3(1.0f / 255.0f);
  }
  const vec3 first = opponent(shown), second = opponent(wanted);
  UNROLL for (uint c = 0u; c < 3u; ++c) {
    s_opponent[c * kSpan + slot] = first[c];
    s_opponent[(3u + c) * kSpan + slot] = second[c];
  }
}

KERNEL_MAIN(64) {
  const uint across = (a.width + 63u) / 64u, group = group_index(), thread = gl_LocalInvocationIndex;
  if (group >= across * a.row_count) return;
  const uint row = group / across, x0 = (group % across) * 64u, taps = 2u * a.radius + 1u;
  for (uint i = thread; i < 64u + 2u * a.radius; i += 64u) {
    const uint x = uint(clamp(int(x0 + i) - int(a.radius), 0, int(a.width) - 1));
    load(GIVES_ARGUMENTS(a.first_row + row) * a.width + x, i);
  }
  barrier();
  const uint x = x0 + thread;
  if (x >= a.width) return;
  for (uint picture = 0u; picture < 2u; ++picture) {
    float sum[FLIP_FILTERS];
    UNROLL for (uint f = 0u; f < FLIP_FILTERS; ++f) sum[f] = 0.0f;
    for (uint k = 0u; k < taps; ++k) {
      const uint at = picture * 3u * kSpan + thread + k;
      const float y = s_opponent[at], red = s_opponent[at + kSpan], blue = s_opponent[at + 2u * kSpan];
      sum[0] += a.taps.v[k] * y;
      sum[1] += a.taps.v[taps + k] * red;
      sum[2] += a.taps.v[2u * taps + k] * blue;
      sum[3] += a.taps.v[3u * taps + k] * blue;
      sum[4] += a.taps.v[4u * taps + k] * y;
      sum[5] += a.taps.v[5u * taps + k] * y;
      sum[6] += a.taps.v[6u * taps + k] * y;
    }
    UNROLL for (uint f = 0u; f < FLIP_FILTERS; ++f)
        a.rows.v[((picture * FLIP_FILTERS + f) * a.row_count + row) * a.width + x] = sum[f];
  }
}
