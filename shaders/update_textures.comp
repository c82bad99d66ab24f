// Updates one triangle's texture: sums its pixels' gradients on the finest lattice, propagates them through the sigmoid
// and to every level, applies Adam to all levels, and computes the finest lattice from their sum and the sigmoid.
#include "common/kernel.h"
#include "args/update_textures.h"
#include "common/non_finite.h"
#include "common/fixed_point.h"
#include "common/block_sums.h"
#include "common/lattice.h"
#include "common/optimiser.h"
#include "common/texture_elements.h"

ARGUMENTS(UpdateTexturesArgs)

CONSTANT(0, uint, SAMPLES, 774u);  // largest number of samples of a triangle in this launch, over all levels
CONSTANT(1, bool, ADAM, true);     // false: only sum the levels
CONSTANT(2, bool, DEBUG, false);   // also write the gradient

SHARED uint s_seen, s_max;
const uint QUADS = 2u;  // vectors per sample: features 0..3; features 4..6 and opacity
// Elements are floats, except for the finest level's sums over pixels.
SHARED_VECTORS(uint, uvec4, s_word, SAMPLES* QUADS);
#define ELEMENT_VALUE(e) uintBitsToFloat(SHARED_ELEMENT(s_word, e))
#define SET_ELEMENT_VALUE(e, v) SHARED_ELEMENT(s_word, e) = floatBitsToUint(v)

#define SAMPLE_VALUE(i, e) ELEMENT_VALUE((i)*kElements + e)
#include "common/lattice_levels.h"

/// Resets the logits of an element that are not finite, or whose moments are not.
FN void reset_lost(TAKES_ARGUMENTS uint first, uint e, INOUT(FLOATS) logit, INOUT(FLOATS) m, INOUT(FLOATS) v) {
  const FLOATS before = ELEMENT(a.source.v, first, e);
  UNROLL for (uint c = 0u; c < kNumbers; ++c) {
    if (usable(NUMBER(logit, c), kLargestLogit) && usable(NUMBER(m, c), kLargestLogit) &&
        usable(NUMBER(v, c), kLargestLogit))
      continue;
    NUMBER(logit, c) = usable(NUMBER(before, c), kLargestLogit) ? NUMBER(before, c) : 0.0f;
    NUMBER(m, c) = NUMBER(v, c) = 0.0f;
    note_non_finite(a.control, NON_FINITE_TEXEL, first * 4u + e * kNumbers + c, a.state.v[0].step);
  }
}

/// Computes the largest feature gradient of the triangle's pixels, in s_max.
FN void find_most(TAKES_ARGUMENTS uint pixels, uint place, uint thread) {
  float max_gradient = 0.0f;
  for (uint first = 0u; first < pixels; first += THREADS)
    if (first + thread < pixels)
      UNROLL for (uint c = 0u; c < 7u; ++c) max_gradient =
          max(max_gradient, abs(limited(a.sorted.v[c * a.pixels + place + first + thread])));
  if (max_gradient != 0.0f) atomicMax(s_max, floatBitsToUint(max_gradient));
}

/// Adds the feature gradients of the triangle's pixels to the three samples around each, in units of the sums.
FN void add_pixels(TAKES_ARGUMENTS Texture row, uint fine, uint pixels, uint place, float units, uint thread) {
  for (uint first = 0u; first < pixels; first += THREADS)
    if (first + thread < pixels) {
      const uint at = place + first + thread;
      const LatticeCell cell =
          lattice_cell(a.sorted.v[7u * a.pixels + at], a.sorted.v[8u * a.pixels + at], row.level_max);
      const uint i0 = (fine + cell.i0) * QUADS, i1 = (fine + cell.i1) * QUADS, i2 = (fine + cell.i2) * QUADS;
      UNROLL for (uint c = 0u; c < 7u; ++c) {
        const float g = limited(a.sorted.v[c * a.pixels + at]) * units;
        atomicAdd(SHARED_WORD(s_word, i0 + c / 4u, c % 4u), whole_units(cell.w0 * g));
        atomicAdd(SHARED_WORD(s_word, i1 + c / 4u, c % 4u), whole_units(cell.w1 * g));
        atomicAdd(SHARED_WORD(s_word, i2 + c / 4u, c % 4u), whole_units(cell.w2 * g));
      }
    }
}

/// Reads the opacity gradients as floats and clears them in memory.
FN void take_opacities(TAKES_ARGUMENTS Texture row, uint fine, uint samples, uint thread) {
  for (uint first = 0u; first < samples; first += THREADS)
    if (first + thread < samples) {
      const uint at = row.lattice_offset + first + thread;
      const uint low = a.gradient_low.v[at], high = a.gradient_high.v[at];
      if (low == kFixedZero && high == 0u) continue;
      SHARED_WORD(s_word, (fine + first + thread) * QUADS + 1u, 3u) = floatBitsToUint(from_fixed(low, high));
      a.gradient_low.v[at] = kFixedZero;
      a.gradient_high.v[at] = 0u;
    }
}

/// Gradient of element e of a level whose samples start at `to`, from the next finer level `level`, whose samples start
/// at `from`.
FN void to_coarser(uint from, uint to, uint level, uint e) {
  SET_ELEMENT_VALUE(to * kElements + e, gathered(from, level, e / kElements, e % kElements));
}

/// Adds the next coarser level, whose samples start at `from`, to element e of a level whose samples start at `to`.
FN void to_finer(uint from, uint to, uint e) {
  uint x, y, p, q;
  lattice_point(e / kElements, x, y);
  coarse_neighbours(x, y, p, q);
  const FLOATS both = SAMPLE_VALUE(from + p, e % kElements) + SAMPLE_VALUE(from + q, e % kElements);
  SET_ELEMENT_VALUE(to * kElements + e, ELEMENT_VALUE(to * kElements + e) + 0.5f * both);
}

// One long function: its parts communicate through shared memory, separated by barriers, which all threads must reach
// in this function.
KERNEL_MAIN(THREADS) {
  const uint thread = gl_LocalInvocationIndex;
  if (group_index() >= a.tasks_count) return;
  const TextureTask task = a.tasks.v[group_index()];
  Texture row;
  row.source_offset = task.source_offset;
  row.lattice_offset = task.lattice_offset;
  row.level_min = task.levels & 255u;
  row.level_max = task.levels >> 8;
  const uint triangle = task.triangle;
  const uint fine = samples_before(row.level_min, row.level_max);
  uint top = row.level_max, fine_count = lattice_samples(top), source_count = fine + fine_count;
  const bool frozen = a.control.v[0].overflow != 0u;

  if (ADAM) {
    // Textures without visible pixels and without opacity gradients are not read. In a scene that surrounds the cameras
    // these are most textures.
    const uint pixels = a.counts.v[triangle], place = a.counts.v[a.triangles + 1u + triangle];
    const uint gradients = (a.unseen | pixels | a.touched.v[triangle]) != 0u ? fine_count * kElements : 0u;
    if (thread == 0u) {
      s_seen = a.unseen;
      s_max = 0u;
    }
    for (uint i = 0u; i < ELEMENT_STEPS(gradients); ++i)
      if (ELEMENT_OF(i, gradients) < gradients)
        SHARED_ELEMENT(s_word, fine * kElements + ELEMENT_OF(i, gradients)) = UINTS(0u);
    barrier();
    if (pixels != 0u) {
      find_most(GIVES_ARGUMENTS pixels, place, thread);
      barrier();
    }
    const uint exponent = unit_exponent(pixels, uintBitsToFloat(s_max));
    add_pixels(GIVES_ARGUMENTS row, fine, pixels, place, units_per_one(exponent), thread);
    take_opacities(GIVES_ARGUMENTS row, fine, gradients / kElements, thread);
    barrier();
    for (uint i = 0u; i < ELEMENT_STEPS(gradients); ++i) {
      const uint e = ELEMENT_OF(i, gradients), first = row.lattice_offset * QUADS;
      if (e < gradients) {
        const UINTS words = SHARED_ELEMENT(s_word, fine * kElements + e);
        FLOATS gradient;
        UNROLL for (uint c = 0u; c < kNumbers; ++c) NUMBER(gradient, c) =
            float(int(NUMBER(words, c))) * unit_of(exponent);
        if (e % kElements == kElements - 1u) NUMBER(gradient, 3u) = uintBitsToFloat(NUMBER(words, 3u));
        if (gradient != FLOATS(0.0f)) {
          const FLOATS value = ELEMENT(a.lattice.v, first, e);
          gradient *= value * (1.0f - value);
          s_seen = 1u;
        }
        SET_ELEMENT_VALUE(fine * kElements + e, gradient);
      }
    }
    barrier();
    // All threads have read it by now.
    if (thread == 0u) a.touched.v[triangle] = 0u;
    // Where branches are masks (llvmpipe), only a loop's trip count skips work.
    if (s_seen == 0u) {
      fine_count = source_count = 0u;
      top = row.level_min;
    }
    for (uint level = top; level > row.level_min; --level) {
      const uint from = samples_before(row.level_min, level), to = samples_before(row.level_min, level - 1u),
                 sums = lattice_samples(level - 1u) * kElements;
      for (uint i = 0u; i < ELEMENT_STEPS(sums); ++i)
        if (ELEMENT_OF(i, sums) < sums) to_coarser(from, to, level, ELEMENT_OF(i, sums));
      barrier();
    }
  }

  const float rate = a.state.v[0].lr_texture, second = a.state.v[0].second_texture;
  const uint elements = source_count * kElements;
  for (uint i = 0u; i < ELEMENT_STEPS(elements); ++i) {
    const uint e = ELEMENT_OF(i, elements), first = row.source_offset * QUADS;
    if (e < elements) {
      FLOATS logit = ELEMENT(a.source.v, first, e), m = FLOATS(0.0f), v = FLOATS(0.0f);
      bool changed = false;
      if (ADAM) {
        const FLOATS gradient = ELEMENT_VALUE(e);
        if (DEBUG) ELEMENT(a.debug.v, first, e) = gradient;
        if (gradient != FLOATS(0.0f) || a.unseen != 0u) {
          m = ELEMENT(a.moment1.v, first, e);
          v = ELEMENT(a.moment2.v, first, e);
          // Zero moments without a gradient stay zero, so values not shown since the moments were reset are skipped.
          changed = !frozen && (gradient != FLOATS(0.0f) || m != FLOATS(0.0f) || v != FLOATS(0.0f));
          if (changed)
            UNROLL for (uint c = 0u; c < kNumbers; ++c) if (NUMBER(gradient, c) != 0.0f || a.unseen != 0u)
                NUMBER(logit, c) -= adam(NUMBER(gradient, c), rate, second, NUMBER(m, c), NUMBER(v, c));
        }
      }
      // If a value of an element is not finite, neither is the sum.
      const FLOATS parts = logit + m + v;
      float sum = 0.0f;
      UNROLL for (uint c = 0u; c < kNumbers; ++c) sum += NUMBER(parts, c);
      if (!usable(sum, kLargestLogit)) {
        reset_lost(GIVES_ARGUMENTS first, e, logit, m, v);
        changed = true;
      }
      if (changed) {
        ELEMENT(a.source.v, first, e) = logit;
        if (ADAM) {
          ELEMENT(a.moment1.v, first, e) = m;
          ELEMENT(a.moment2.v, first, e) = v;
        }
      }
      SET_ELEMENT_VALUE(e, logit);
    }
  }

  for (uint level = row.level_min + 1u; level <= top; ++level) {
    barrier();
    const uint from = samples_before(row.level_min, level - 1u), to = samples_before(row.level_min, level),
               sums = lattice_samples(level) * kElements;
    for (uint i = 0u; i < ELEMENT_STEPS(sums); ++i)
      if (ELEMENT_OF(i, sums) < sums) to_finer(from, to, ELEMENT_OF(i, sums));
  }
  barrier();
  const uint values = fine_count * kElements;
  for (uint i = 0u; i < ELEMENT_STEPS(values); ++i) {
    const uint e = ELEMENT_OF(i, values);
    if (e < values) {
      const FLOATS logit = ELEMENT_VALUE(fine * kElements + e);
      FLOATS value;
      UNROLL for (uint c = 0u; c < kNumbers; ++c) NUMBER(value, c) = sigmoid(NUMBER(logit, c));
      ELEMENT(a.lattice.v, row.lattice_offset * QUADS, e) = value;
      SET_ELEMENT_VALUE(fine * kElements + e, value);
    }
  }
  barrier();
  for (uint i = thread; i < fine_count; i += THREADS)
    a.opacity.v[row.lattice_offset + i] = uintBitsToFloat(SHARED_WORD(s_word, (fine + i) * QUADS + 1u, 3u));
}
