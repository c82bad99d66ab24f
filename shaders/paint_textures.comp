// Initialises textures with the mean of the photographs' colours. Where few pixels show a sample, the next coarser
// level contributes; for the coarsest level, the initial colours of the triangle's corners do.
#include "common/kernel.h"
#include "args/paint_textures.h"
#include "common/fixed_point.h"
#include "common/lattice.h"

const float kPrior = 0.5f / 128.0f;  // weight of the coarser level: half a pixel, in the units of the sums
// Initial weight of the MLP, a logit: small, because the mean over the views is a good estimate, but large enough to
// have a gradient.
const float kMlpShare = -3.0f;

SHARED vec4 s_sample[783];  // all levels, coarse to fine: sums of colours and weights, then colours

#define FLOATS vec4
#define SAMPLE_VALUE(i, e) s_sample[(i) + (e)]  // one element per sample
#include "common/lattice_levels.h"

FN vec3 logit_of(vec3 colour) {
  const vec3 c = clamp(colour, vec3(0.02f), vec3(0.98f));
  return vec3(logit(c.x), logit(c.y), logit(c.z));
}

KERNEL(64, PaintTexturesArgs) {
  const uint triangle = group_index(), thread = gl_LocalInvocationIndex;
  if (triangle >= a.triangles) return;
  const Texture row = a.textures.v[triangle];
  const uint old = a.old_textures.v[a.parents.v[triangle]].source_offset * 2u;
  const uint fine = samples_before(row.level_min, row.level_max);
  for (uint i = thread; i < lattice_samples(row.level_max); i += 64u) {
    const uint at = (row.lattice_offset + i) * 4u;
    UNROLL for (uint c = 0u; c < 4u; ++c) s_sample[fine + i][c] = from_fixed(a.low.v[at + c], a.high.v[at + c]);
  }
  barrier();
  for (uint level = row.level_max; level > row.level_min; --level) {
    const uint from = samples_before(row.level_min, level), to = samples_before(row.level_min, level - 1u);
    for (uint i = thread; i < lattice_samples(level - 1u); i += 64u) s_sample[to + i] = gathered(from, level, i, 0u);
    barrier();
  }
  for (uint level = row.level_min; level <= row.level_max; ++level) {
    const uint first = samples_before(row.level_min, level);
    for (uint i = thread; i < lattice_samples(level); i += 64u) {
      uint x, y;
      lattice_point(i, x, y);
      vec3 prior, there = vec3(0.0f);
      if (level == row.level_min) {
        const float r = float(1u << level);
        const LatticeCell cell = lattice_cell(float(x) / r, float(y) / r, 0u);
        const vec4 c0 = a.old_source.v[old + 2u * cell.i0], c1 = a.old_source.v[old + 2u * cell.i1];
        const vec4 c2 = a.old_source.v[old + 2u * cell.i2];
        prior = vec3(lattice_mix(cell, sigmoid(c0.x), sigmoid(c1.x), sigmoid(c2.x)),
                     lattice_mix(cell, sigmoid(c0.y), sigmoid(c1.y), sigmoid(c2.y)),
                     lattice_mix(cell, sigmoid(c0.z), sigmoid(c1.z), sigmoid(c2.z)));
      } else {
        // Levels are summed, so this level stores the difference to the coarser ones.
        const uint coarser = samples_before(row.level_min, level - 1u);
        uint p, q;
        coarse_neighbours(x, y, p, q);
        const vec3 cp = vec3(s_sample[coarser + p]), cq = vec3(s_sample[coarser + q]);
        prior = 0.5f * (cp + cq);
        there = 0.5f * (logit_of(cp) + logit_of(cq));
      }
      const vec4 sum = s_sample[first + i];
      const vec3 colour = (vec3(sum) + kPrior * prior) / (sum.w + kPrior);
      s_sample[first + i] = vec4(colour, 0.0f);
      const uint to = (row.source_offset + first + i) * 2u;
      const bool coarsest = level == row.level_min;
      a.source.v[to] = vec4(logit_of(colour) - there, coarsest ? kMlpShare : 0.0f);
      a.source.v[to + 1u] = vec4(0.0f, 0.0f, 0.0f, coarsest ? a.old_source.v[old + 1u].w : 0.0f);
    }
    barrier();
  }
}
