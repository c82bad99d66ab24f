// Fits the exposures of a batch's photographs. What they differ from the start's, without its mean over all
// photographs, is shrunk by how well it is known: what a camera's photographs have in common (vignetting), and what
// each adds. One workgroup.
#include "common/kernel.h"
#include "args/fit_exposure.h"
#include "common/exposure.h"
#include "common/exposure_table.h"
#include "common/fixed_point.h"

ARGUMENTS(FitExposureArgs)

// Each lane adds up the photographs at one place; kAtOnce lanes share a place.
const uint kAtOnce = 64u / EXPOSURE_PLACES, kLanes = kAtOnce * EXPOSURE_PLACES;
// A picture's pixels by those that count for one of its inner places.
const float kPlacesOfPicture = float((EXPOSURE_SIDE - 1u) * (EXPOSURE_SIDE - 1u));
// Of each place, then of the lanes that help.
SHARED vec4 s_all[64];   // of all photographs: sum of gains beyond the start's; number
SHARED vec4 s_gain[64];  // of a camera's photographs: sum of gains beyond the start's; of variances
SHARED vec2 s_rest[64];  // of a camera's photographs: sum of squared gains; number

FN vec3 start_of(TAKES_ARGUMENTS uint row) { return load_exposure(a.start, row).gain; }

/// Whether no earlier view of the batch shows the same photograph. A batch that spans two epochs can contain a
/// photograph twice.
FN bool is_first_of_photograph(TAKES_ARGUMENTS uint view) {
  for (uint v = 0u; v < view; ++v)
    if (a.views.v[v].index == a.views.v[view].index) return false;
  return true;
}

/// Whether no earlier view of the batch is by the same camera.
FN bool is_first_of_camera(TAKES_ARGUMENTS uint view) {
  for (uint v = 0u; v < view; ++v)
    if (a.cameras.v[a.views.v[v].index] == a.cameras.v[a.views.v[view].index]) return false;
  return true;
}

/// The gain of a row beyond the start's, and its variance.
FN vec4 beyond_start(TAKES_ARGUMENTS uint row) {
  const Exposure m = load_exposure(a.fitted, row);
  return vec4(m.gain - start_of(GIVES_ARGUMENTS row), m.variance);
}

/// Adds `weight` times a row to the sums of a lane.
FN void add_row(TAKES_ARGUMENTS uint row, float weight, bool of_camera, uint lane) {
  const vec4 gain = beyond_start(GIVES_ARGUMENTS row);
  const vec3 beyond = vec3(gain);
  s_all[lane] += weight * vec4(beyond, 1.0f);
  if (!of_camera) return;
  s_gain[lane] += weight * gain;
  s_rest[lane] += weight * vec2(dot(beyond, beyond), 1.0f);
}

/// Sums up all photographs, and those of a camera, at each place.
FN void add_up(TAKES_ARGUMENTS uint camera, uint lane) {
  s_all[lane] = s_gain[lane] = vec4(0.0f);
  s_rest[lane] = vec2(0.0f);
  for (uint p = lane / EXPOSURE_PLACES; p < a.photographs && lane < kLanes; p += kAtOnce)
    add_row(GIVES_ARGUMENTS p * EXPOSURE_PLACES + lane % EXPOSURE_PLACES, 1.0f, a.cameras.v[p] == camera, lane);
  barrier();
  if (lane < EXPOSURE_PLACES)
    for (uint i = lane + EXPOSURE_PLACES; i < kLanes; i += EXPOSURE_PLACES) {
      s_all[lane] += s_all[i];
      s_gain[lane] += s_gain[i];
      s_rest[lane] += s_rest[i];
    }
  barrier();
}

/// What the photographs of a camera have in common at a place, beyond the start's exposures.
struct Common {
  vec3 mean;        // of all photographs and places
  vec3 gain;        // of the camera's photographs at the place, beyond `mean`
  float share;      // factor by which `gain` is shrunk
  float own_share;  // the same for what a photograph adds
};

/// without: a photograph of the camera that is left out; ~0: none.
FN Common common_at(TAKES_ARGUMENTS uint place, uint without) {
  const float one = 1.0f / float(EXPOSURE_PLACES);
  vec4 all = vec4(0.0f);
  vec3 own_mean = vec3(0.0f);
  float variance = 0.0f, squares = 0.0f, squared_means = 0.0f, photographs = 0.0f;
  Common c;
  c.gain = vec3(0.0f);
  for (uint k = 0u; k < EXPOSURE_PLACES; ++k) {
    vec4 gain = s_gain[k];
    vec2 rest = s_rest[k];
    if (without != ~0u) {
      const vec4 its = beyond_start(GIVES_ARGUMENTS without * EXPOSURE_PLACES + k);
      gain -= its;
      rest -= vec2(dot(vec3(its), vec3(its)), 1.0f);
    }
    photographs = rest.y;
    const vec3 here = vec3(gain) / max(photographs, 1.0f);
    all += s_all[k];
    own_mean += one * here;
    variance += one * gain.w / max(photographs, 1.0f);
    squares += one * rest.x / max(photographs, 1.0f);
    squared_means += one * dot(here, here);
    if (k == place) c.gain = here;
  }
  c.mean = vec3(all) / all.w;
  c.gain -= c.mean;
  const float common_squares = squared_means - 2.0f * dot(c.mean, own_mean) + dot(c.mean, c.mean);
  c.share = photographs > 0.0f ? exposure_share(common_squares / 3.0f, variance / photographs) : 0.0f;
  c.own_share = photographs > 0.0f ? exposure_share((squares - squared_means) / 3.0f, variance) : 0.0f;
  return c;
}

/// Fits the exposure of the photograph of `view` at one of its places from all its views in the batch. prior: what it
/// is drawn to.
FN Exposure fit(TAKES_ARGUMENTS uint view, uint place, vec3 prior) {
  vec4 sums[EXPOSURE_SUMS];
  float pixels = 0.0f;
  UNROLL for (uint i = 0u; i < EXPOSURE_SUMS; ++i) sums[i] = vec4(0.0f);
  for (uint v = view; v < a.view_count; ++v) {
    if (a.views.v[v].index != a.views.v[view].index) continue;
    pixels += float(a.views.v[v].width * a.views.v[v].height);
    UNROLL for (uint i = 0u; i < EXPOSURE_SUMS; ++i) UNROLL for (uint c = 0u; c < 4u; ++c) {
      const uint at = ((v * EXPOSURE_PLACES + place) * EXPOSURE_SUMS + i) * 4u + c;
      sums[i][c] += from_fixed(a.sums_low.v[at], a.sums_high.v[at]);
    }
  }
  return fitted_exposure(sums, load_exposure(a.exposure, a.views.v[view].index * EXPOSURE_PLACES + place), prior,
                         sums[0].w * 256.0f * kPlacesOfPicture / pixels);
}

/// Fits the exposures of the batch's photographs by the camera of `view`.
FN void fit_camera(TAKES_ARGUMENTS uint view, uint lane) {
  const uint camera = a.cameras.v[a.views.v[view].index];
  add_up(GIVES_ARGUMENTS camera, lane);
  for (uint v = view; v < a.view_count; ++v) {
    const uint photograph = a.views.v[v].index, row = photograph * EXPOSURE_PLACES + lane;
    if (a.cameras.v[photograph] != camera || !is_first_of_photograph(GIVES_ARGUMENTS v)) continue;
    Exposure m;
    if (lane < EXPOSURE_PLACES) {
      const Common others = common_at(GIVES_ARGUMENTS lane, photograph);
      m = fit(GIVES_ARGUMENTS v, lane, start_of(GIVES_ARGUMENTS row) + others.share * (others.mean + others.gain));
    }
    barrier();
    if (lane < EXPOSURE_PLACES) {
      add_row(GIVES_ARGUMENTS row, -1.0f, true, lane);
      store_exposure(a.fitted, row, m);
      add_row(GIVES_ARGUMENTS row, 1.0f, true, lane);
    }
    barrier();
  }
  const Common c = common_at(GIVES_ARGUMENTS lane, ~0u);
  for (uint v = view; v < a.view_count; ++v) {
    const uint photograph = a.views.v[v].index, row = photograph * EXPOSURE_PLACES + lane;
    if (a.cameras.v[photograph] != camera || lane >= EXPOSURE_PLACES) continue;
    const vec3 start = start_of(GIVES_ARGUMENTS row);
    Exposure shrunk = load_exposure(a.fitted, row);
    shrunk.gain = start + c.share * c.gain + c.own_share * (shrunk.gain - start - c.mean - c.gain);
    shrunk.gain = clamp(shrunk.gain, vec3(-EXPOSURE_MOST), vec3(EXPOSURE_MOST));
    store_exposure(a.exposure, row, shrunk);
  }
  barrier();
}

KERNEL_MAIN(64) {
  const uint lane = gl_LocalInvocationIndex;
  const uint views = a.control.v[0].overflow != 0u ? 0u : a.view_count;  // an overflown step will be repeated
  for (uint view = 0u; view < views; ++view)
    if (is_first_of_camera(GIVES_ARGUMENTS view)) fit_camera(GIVES_ARGUMENTS view, lane);
  for (uint i = lane; i < a.view_count * EXPOSURE_PLACES * 4u * EXPOSURE_SUMS; i += 64u) {
    a.sums_low.v[i] = kFixedZero;
    a.sums_high.v[i] = 0u;
  }
}
