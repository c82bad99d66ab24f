// Fits the exposures of a batch's photographs. What they differ from the start's is shrunk, without its mean over all
// photographs. One workgroup.
#include "common/kernel.h"
#include "args/fit_exposure.h"
#include "common/exposure.h"
#include "common/exposure_table.h"
#include "common/fixed_point.h"

ARGUMENTS(FitExposureArgs)

SHARED vec4 s_gain[64];
SHARED float s_squares[64];

/// Sums over photographs of gains beyond the start's.
struct ExposureTotal {
  vec3 gain;
  float variance, squares;
};

FN void add_exposure(IN(Exposure) m, vec3 start, float weight, INOUT(ExposureTotal) total) {
  const vec3 gain = m.gain - start;
  total.gain += weight * gain;
  total.variance += weight * m.variance;
  total.squares += weight * dot(gain, gain);
}

FN vec3 start_of(TAKES_ARGUMENTS uint row) { return load_exposure(a.start, row).gain; }

/// Whether no earlier view of the batch shows the same photograph. A batch that spans two epochs can contain a
/// photograph twice.
FN bool is_first_of_photograph(TAKES_ARGUMENTS uint view) {
  for (uint v = 0u; v < view; ++v)
    if (a.views.v[v].index == a.views.v[view].index) return false;
  return true;
}

/// Fits the exposure of the photograph of `view` at one of its places from all its views in the batch.
FN Exposure fit(TAKES_ARGUMENTS uint view, uint place) {
  vec4 sums[EXPOSURE_SUMS];
  UNROLL for (uint i = 0u; i < EXPOSURE_SUMS; ++i) sums[i] = vec4(0.0f);
  for (uint v = view; v < a.view_count; ++v) {
    if (a.views.v[v].index != a.views.v[view].index) continue;
    UNROLL for (uint i = 0u; i < EXPOSURE_SUMS; ++i) UNROLL for (uint c = 0u; c < 4u; ++c) {
      const uint at = ((v * EXPOSURE_PLACES + place) * EXPOSURE_SUMS + i) * 4u + c;
      sums[i][c] += from_fixed(a.sums_low.v[at], a.sums_high.v[at]);
    }
  }
  const uint row = a.views.v[view].index * EXPOSURE_PLACES + place;
  return fitted_exposure(sums, load_exposure(a.exposure, row), start_of(GIVES_ARGUMENTS row));
}

KERNEL_MAIN(64) {
  const uint thread = gl_LocalInvocationIndex;
  const bool keep = a.control.v[0].overflow != 0u;  // this step will be repeated
  const uint rows = a.photographs * EXPOSURE_PLACES, fits = a.view_count * EXPOSURE_PLACES;
  ExposureTotal total;
  total.gain = vec3(0.0f);
  total.variance = total.squares = 0.0f;
  for (uint i = thread; i < rows; i += 64u)
    add_exposure(load_exposure(a.fitted, i), start_of(GIVES_ARGUMENTS i), 1.0f, total);
  barrier();  // all values are read before any is changed
  for (uint i = thread; i < fits; i += 64u) {
    const uint view = i / EXPOSURE_PLACES, place = i % EXPOSURE_PLACES;
    if (keep || !is_first_of_photograph(GIVES_ARGUMENTS view)) continue;
    const uint row = a.views.v[view].index * EXPOSURE_PLACES + place;
    const vec3 start = start_of(GIVES_ARGUMENTS row);
    add_exposure(load_exposure(a.fitted, row), start, -1.0f, total);
    const Exposure now = fit(GIVES_ARGUMENTS view, place);
    add_exposure(now, start, 1.0f, total);
    store_exposure(a.fitted, row, now);
  }
  s_gain[thread] = vec4(total.gain, total.variance);
  s_squares[thread] = total.squares;
  barrier();
  total.gain = vec3(0.0f);
  total.variance = total.squares = 0.0f;
  for (uint i = 0u; i < 64u; ++i) {
    total.gain += vec3(s_gain[i]);
    total.variance += s_gain[i].w;
    total.squares += s_squares[i];
  }
  const float one = 1.0f / float(rows);
  const vec3 mean = one * total.gain;
  const float spread = (one * total.squares - dot(mean, mean)) / 3.0f;
  const float share = exposure_share(spread, one * total.variance);
  for (uint i = thread; i < fits; i += 64u) {
    const uint view = i / EXPOSURE_PLACES, place = i % EXPOSURE_PLACES;
    if (keep || !is_first_of_photograph(GIVES_ARGUMENTS view)) continue;
    const uint row = a.views.v[view].index * EXPOSURE_PLACES + place;
    const vec3 start = start_of(GIVES_ARGUMENTS row);
    Exposure shrunk = load_exposure(a.fitted, row);
    shrunk.gain = start + share * (shrunk.gain - start - mean);
    store_exposure(a.exposure, row, shrunk);
  }
  for (uint i = thread; i < fits * 4u * EXPOSURE_SUMS; i += 64u) {
    a.sums_low.v[i] = kFixedZero;
    a.sums_high.v[i] = 0u;
  }
}
