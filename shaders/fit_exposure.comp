// Fits the exposures of a batch's photographs and removes the mean exposure of all photographs. One workgroup.
#include "common/kernel.h"
#include "args/fit_exposure.h"
#include "common/exposure.h"
#include "common/exposure_table.h"
#include "common/fixed_point.h"

ARGUMENTS(FitExposureArgs)

SHARED vec4 s_gain[64], s_offset[64];

/// Sums over photographs.
struct ExposureTotal {
  vec3 gain, offset;
  float variance, squares;  // squares: of gains minus 1
};

FN void add_exposure(IN(Exposure) m, float weight, INOUT(ExposureTotal) total) {
  const vec3 gain = m.gain - 1.0f;
  total.gain += weight * m.gain;
  total.offset += weight * m.offset;
  total.variance += weight * m.variance;
  total.squares += weight * dot(gain, gain);
}

/// Whether no earlier view of the batch shows the same photograph. A batch that spans two epochs can contain a
/// photograph twice.
FN bool is_first_of_photograph(TAKES_ARGUMENTS uint view) {
  for (uint v = 0u; v < view; ++v)
    if (a.views.v[v].index == a.views.v[view].index) return false;
  return true;
}

/// Fits the exposure of the photograph of `view` from all its views in the batch.
FN Exposure fit(TAKES_ARGUMENTS uint view) {
  vec4 sums[EXPOSURE_SUMS];
  UNROLL for (uint i = 0u; i < EXPOSURE_SUMS; ++i) sums[i] = vec4(0.0f);
  for (uint v = view; v < a.view_count; ++v) {
    if (a.views.v[v].index != a.views.v[view].index) continue;
    UNROLL for (uint i = 0u; i < EXPOSURE_SUMS; ++i) UNROLL for (uint c = 0u; c < 4u; ++c) {
      const uint at = (v * EXPOSURE_SUMS + i) * 4u + c;
      sums[i][c] += from_fixed(a.sums_low.v[at], a.sums_high.v[at]);
    }
  }
  return fitted_exposure(sums);
}

KERNEL_MAIN(64) {
  const uint thread = gl_LocalInvocationIndex;
  const bool keep = a.control.v[0].overflow != 0u;  // this step will be repeated
  ExposureTotal total;
  total.gain = total.offset = vec3(0.0f);
  total.variance = total.squares = 0.0f;
  for (uint i = thread; i < a.photographs; i += 64u) add_exposure(load_exposure(a.fitted, i), 1.0f, total);
  barrier();  // all values are read before any is changed
  for (uint view = thread; view < a.view_count; view += 64u) {
    if (keep || !is_first_of_photograph(GIVES_ARGUMENTS view)) continue;
    const uint photograph = a.views.v[view].index;
    add_exposure(load_exposure(a.fitted, photograph), -1.0f, total);
    const Exposure now = fit(GIVES_ARGUMENTS view);
    add_exposure(now, 1.0f, total);
    store_exposure(a.fitted, photograph, now);
  }
  s_gain[thread] = vec4(total.gain, total.variance);
  s_offset[thread] = vec4(total.offset, total.squares);
  barrier();
  total.gain = total.offset = vec3(0.0f);
  total.variance = total.squares = 0.0f;
  for (uint i = 0u; i < 64u; ++i) {
    total.gain += vec3(s_gain[i]);
    total.offset += vec3(s_offset[i]);
    total.variance += s_gain[i].w;
    total.squares += s_offset[i].w;
  }
  const float one = 1.0f / float(a.photographs);
  Exposure mean;
  mean.gain = one * total.gain;
  mean.offset = one * total.offset;
  mean.variance = one * total.variance;
  const float spread = (one * total.squares - dot(mean.gain - 1.0f, mean.gain - 1.0f)) / 3.0f;
  const float share = exposure_share(spread, mean.variance);
  for (uint view = thread; view < a.view_count; view += 64u) {
    if (keep || !is_first_of_photograph(GIVES_ARGUMENTS view)) continue;
    const uint photograph = a.views.v[view].index;
    store_exposure(a.exposure, photograph, exposure_beyond(load_exposure(a.fitted, photograph), mean, share));
  }
  for (uint i = thread; i < a.view_count * 4u * EXPOSURE_SUMS; i += 64u) {
    a.sums_low.v[i] = kFixedZero;
    a.sums_high.v[i] = 0u;
  }
}
