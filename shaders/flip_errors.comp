// FLIP (Andersson et al. 2020): filters the columns of flip_rows.comp and compares rendering and photograph.
#include "common/kernel.h"
#include "args/flip_errors.h"
#include "args/flip_rows.h"
#include "common/fixed_point.h"
#include "common/photograph.h"
#include "common/powers.h"
#include "common/flip.h"

ARGUMENTS(FlipErrorsArgs)

SHARED float s_sum[64];
SHARED uint s_count[64];

/// What the filters see at a pixel of one picture.
struct Filtered {
  vec3 colour;        // opponent colours
  float edge, point;  // strength of the features
};

FN Filtered filter_columns(TAKES_ARGUMENTS uint picture, uint x, uint y) {
  const uint taps = 2u * a.radius + 1u, plane = a.row_count * a.width;
  vec4 colour = vec4(0.0f), feature = vec4(0.0f);
  for (uint k = 0u; k < taps; ++k) {
    const uint row = uint(clamp(int(y + k) - int(a.radius), 0, int(a.height) - 1)) - a.first_row;
    const uint at = picture * FLIP_FILTERS * plane + row * a.width + x;
    colour += vec4(a.taps.v[k], a.taps.v[taps + k], a.taps.v[2u * taps + k], a.taps.v[3u * taps + k]) *
              vec4(a.rows.v[at], a.rows.v[at + plane], a.rows.v[at + 2u * plane], a.rows.v[at + 3u * plane]);
    const float smooth_row = a.rows.v[at + 4u * plane], first = a.rows.v[at + 5u * plane],
                second = a.rows.v[at + 6u * plane];
    const float smooth_tap = a.taps.v[4u * taps + k];
    feature += vec4(smooth_tap * first, a.taps.v[5u * taps + k] * smooth_row, smooth_tap * second,
                    a.taps.v[6u * taps + k] * smooth_row);
  }
  Filtered result;
  result.colour = vec3(colour.x, colour.y, a.blue_share * colour.z + (1.0f - a.blue_share) * colour.w);
  result.edge = sqrt(feature.x * feature.x + feature.y * feature.y);
  result.point = sqrt(feature.z * feature.z + feature.w * feature.w);
  return result;
}

FN float error_at(TAKES_ARGUMENTS uint x, uint y) {
  const Filtered shown = filter_columns(GIVES_ARGUMENTS 0u, x, y);
  const Filtered wanted = filter_columns(GIVES_ARGUMENTS 1u, x, y);
  const float colour = colour_error(shown.colour, wanted.colour, a.most);
  const float feature = sqrt(max(abs(shown.edge - wanted.edge), abs(shown.point - wanted.point)) * 0.70710678f);
  return power(colour, 1.0f - min(feature, 1.0f));
}

KERNEL_MAIN(64) {
  const uint across = (a.width + 63u) / 64u, group = group_index(), thread = gl_LocalInvocationIndex;
  if (group >= across * (a.last - a.first)) return;
  const uint y = a.first + group / across, x = (group % across) * 64u + thread;
  float error = 0.0f;
  uint count = 0u;
  if (x < a.width) {
    if (in_mask(a.target.v[y * a.width + x])) {
      error = error_at(GIVES_ARGUMENTS x, y);
      count = 1u;
    }
    a.errors.v[y * a.width + x] = error;
  }
  s_sum[thread] = error;
  s_count[thread] = count;
  barrier();
  if (thread == 0u) {
    for (uint k = 1u; k < 64u; ++k) {
      error += s_sum[k];
      count += s_count[k];
    }
    add_fixed(a.sums, 0u, a.sums, 1u, error * (1.0f / IMAGE_SUM_UNIT));
    atomicAdd(a.sums.v[2], count);
  }
}
