// One triangle's texture: gradient on the finest lattice through the sigmoid and down to every level, Adam on all levels, their
// sum up to the finest lattice again, sigmoid. The hat functions of the levels are nested, so both directions go one level at a
// time: a coarse sample takes its own fine sample's gradient and half of the six around it.
#include "common/kernel.h"
#include "args/update_textures.h"
#include "common/faults.h"
#include "common/fixed_point.h"
#include "common/lattice.h"
#include "common/optimiser.h"

ARGUMENTS(UpdateTexturesArgs)

CONSTANT(0, uint, SAMPLES, 774u);  // the most that a triangle of this launch has, all levels
CONSTANT(1, bool, ADAM, true);     // false: only sum the levels
CONSTANT(2, bool, DEBUG, false);   // also write the gradient

SHARED uint s_seen;
const uint QUADS = 2u;  // vectors per sample: features 0..3; features 4..6 and opacity
SHARED vec4 s_value[SAMPLES * QUADS];

// Runs over `count` elements so that eight neighbouring threads always hold eight neighbouring elements, and the same eight go on
// with the next: whole cache lines for a GPU, one stream of memory for a CPU that runs eight threads as one.
#define FOR_ELEMENTS(e, count)                                                                                    \
  for (uint e##_rows = ((count) + 63u) / 64u, e##_i = 0u, e = (thread / 8u) * e##_rows * 8u + thread % 8u;        \
       e##_i < e##_rows; ++e##_i, e += 8u)                                                                        \
    if (e < (count))

FN uint samples_before(uint level_min, uint level) {
  uint n = 0u;
  for (uint l = level_min; l < level; ++l) n += lattice_samples(l);
  return n;
}

/// Resets those of four logits that are not numbers, or whose moments are not.
FN void reset_lost(TAKES_ARGUMENTS uint at, INOUT(vec4) logit, INOUT(vec4) m, INOUT(vec4) v) {
  const vec4 before = a.source.v[at];
  UNROLL for (uint c = 0u; c < 4u; ++c) {
    if (usable(logit[c], kLargestLogit) && usable(m[c], kLargestLogit) && usable(v[c], kLargestLogit)) continue;
    logit[c] = usable(before[c], kLargestLogit) ? before[c] : 0.0f;
    m[c] = v[c] = 0.0f;
    note_fault(a.control, FAULT_TEXEL, at * 4u + c, a.state.v[0].step);
  }
}

KERNEL_MAIN(64) {
  const uint triangle = group_index();
  const uint thread = gl_LocalInvocationIndex;
  if (triangle >= a.triangles) return;
  const Texture row = a.textures.v[triangle];
  const uint fine = samples_before(row.level_min, row.level_max);
  uint top = row.level_max, fine_count = lattice_samples(top), source_count = fine + fine_count;
  const bool frozen = a.control.v[0].overflow != 0u;

  if (ADAM) {
    // What nothing was added to is not even read: where cameras stand in a scene, that is most of it.
    const uint gradients = (a.unseen | a.touched.v[triangle]) != 0u ? fine_count * QUADS : 0u;
    if (thread == 0u) s_seen = a.unseen;
    barrier();
    FOR_ELEMENTS(e, gradients) {
      const uint at = (row.lattice_offset + e / QUADS) * 2u + e % QUADS;
      const uvec4 low = a.gradient_low.v[at], high = a.gradient_high.v[at];
      vec4 gradient = vec4(0.0f);
      if (low != uvec4(kFixedZero) || high != uvec4(0u)) {
        const vec4 value = a.lattice.v[at];
        UNROLL for (uint c = 0u; c < 4u; ++c) gradient[c] = from_fixed(low[c], high[c]);
        gradient *= value * (1.0f - value);
        a.gradient_low.v[at] = uvec4(kFixedZero);
        a.gradient_high.v[at] = uvec4(0u);
        s_seen = 1u;
      }
      s_value[fine * QUADS + e] = gradient;
    }
    barrier();
    // Every thread has counted by it.
    if (thread == 0u) a.touched.v[triangle] = 0u;
    // Only a loop's trip count skips work where a branch is a mask (llvmpipe).
    if (s_seen == 0u) {
      fine_count = source_count = 0u;
      top = row.level_min;
    }
    for (uint level = top; level > row.level_min; --level) {
      const uint from = samples_before(row.level_min, level), to = samples_before(row.level_min, level - 1u);
      const uint r = 1u << level;
      for (uint e = thread; e < lattice_samples(level - 1u) * QUADS; e += 64u) {
        const uint q = e % QUADS;
        uint x, y;
        lattice_point(e / QUADS, x, y);
        x *= 2u;
        y *= 2u;
        vec4 around = vec4(0.0f);
        if (x + y < r) {
          around += s_value[(from + lattice_index(x + 1u, y)) * QUADS + q];
          around += s_value[(from + lattice_index(x, y + 1u)) * QUADS + q];
        }
        if (x > 0u) {
          around += s_value[(from + lattice_index(x - 1u, y)) * QUADS + q];
          around += s_value[(from + lattice_index(x - 1u, y + 1u)) * QUADS + q];
        }
        if (y > 0u) {
          around += s_value[(from + lattice_index(x, y - 1u)) * QUADS + q];
          around += s_value[(from + lattice_index(x + 1u, y - 1u)) * QUADS + q];
        }
        s_value[to * QUADS + e] = s_value[(from + lattice_index(x, y)) * QUADS + q] + 0.5f * around;
      }
      barrier();
    }
  }

  const float rate = a.state.v[0].rate_texture, second = a.state.v[0].second_texture;
  FOR_ELEMENTS(e, source_count * QUADS) {
    const uint at = (row.source_offset + e / QUADS) * 2u + e % QUADS;
    vec4 logit = a.source.v[at], m = vec4(0.0f), v = vec4(0.0f);
    bool changed = false;
    if (ADAM) {
      const vec4 gradient = s_value[e];
      if (DEBUG) a.debug.v[at] = gradient;
      m = a.moment1.v[at];
      v = a.moment2.v[at];
      if (!frozen) {
        // Moments that are zero stay so without a gradient: what no view has shown since they were reset is left alone.
        changed = gradient != vec4(0.0f) || m != vec4(0.0f) || v != vec4(0.0f);
        if (changed) UNROLL for (uint c = 0u; c < 4u; ++c) logit[c] -= adam(gradient[c], rate, second, m[c], v[c]);
      }
    }
    // What is not a number in one of twelve values is not one in their sum.
    const vec4 sum = logit + m + v;
    if (!usable(sum.x + sum.y + sum.z + sum.w, kLargestLogit)) {
      reset_lost(GIVES_ARGUMENTS at, logit, m, v);
      changed = true;
    }
    if (changed) {
      a.source.v[at] = logit;
      if (ADAM) {
        a.moment1.v[at] = m;
        a.moment2.v[at] = v;
      }
    }
    s_value[e] = logit;
  }

  for (uint level = row.level_min + 1u; level <= top; ++level) {
    barrier();
    const uint from = samples_before(row.level_min, level - 1u), to = samples_before(row.level_min, level);
    for (uint e = thread; e < lattice_samples(level) * QUADS; e += 64u) {
      const uint q = e % QUADS;
      uint x, y;
      lattice_point(e / QUADS, x, y);
      // The two coarse samples that a fine one lies between; the same one twice where they coincide.
      const uint x0 = x >> 1, y0 = y >> 1, ox = x & 1u, oy = y & 1u;
      const uint i = lattice_index(x0 + ox, y0), j = lattice_index(x0, y0 + oy);
      s_value[to * QUADS + e] += 0.5f * (s_value[(from + i) * QUADS + q] + s_value[(from + j) * QUADS + q]);
    }
  }
  barrier();
  FOR_ELEMENTS(e, fine_count * QUADS) {
    const uint sample_index = row.lattice_offset + e / QUADS, quad = e % QUADS;
    const vec4 logit = s_value[fine * QUADS + e];
    const vec4 value = vec4(sigmoid(logit.x), sigmoid(logit.y), sigmoid(logit.z), sigmoid(logit.w));
    a.lattice.v[sample_index * 2u + quad] = value;
    if (quad == 1u) a.opacity.v[sample_index] = value.w;
  }
}
