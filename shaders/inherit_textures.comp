// Textures after a refinement: every triangle inherits its parent's texture, resampled onto its own part of the parent,
// or, as published, copied as if it were the whole parent. One workgroup per triangle.
#include "common/kernel.h"
#include "args/inherit_textures.h"
#include "common/lattice.h"

/// Channel c at (b0, b1) of a level whose samples start at `base`.
FN float look_up(Floats source, uint base, uint level, vec2 b, uint c) {
  const LatticeCell cell = lattice_cell(b.x, b.y, level);
  return lattice_mix(cell, source.v[(base + cell.i0) * 8u + c], source.v[(base + cell.i1) * 8u + c],
                     source.v[(base + cell.i2) * 8u + c]);
}

KERNEL(64, InheritTexturesArgs) {
  const uint triangle = group_index();
  if (triangle >= a.triangles) return;
  const uint thread = gl_LocalInvocationIndex;
  const Texture old_row = a.old_textures.v[a.parents.v[triangle]], new_row = a.new_textures.v[triangle];

  vec2 corner[3] = {vec2(1.0f, 0.0f), vec2(0.0f, 1.0f), vec2(0.0f)};
  bool whole = true;
  if (a.copy == 0u) {
    for (uint k = 0u; k < 3u; ++k) {
      const vec2 b = vec2(a.corners.v[triangle * 6u + 2u * k], a.corners.v[triangle * 6u + 2u * k + 1u]);
      whole = whole && b == corner[k];
      corner[k] = b;
    }
  }
  if (whole && old_row.level_min == new_row.level_min && old_row.level_max == new_row.level_max) {
    uint samples = 0u;
    for (uint l = new_row.level_min; l <= new_row.level_max; ++l) samples += lattice_samples(l);
    for (uint e = thread; e < samples * 8u; e += 64u)
      a.new_source.v[new_row.source_offset * 8u + e] = a.old_source.v[old_row.source_offset * 8u + e];
    return;
  }

  // A function that is piecewise linear on the parent's lattice is not so on the child's. Each coarse level therefore
  // agrees only at its own points. The finest level stores the remainder, so that the sum agrees at every point of the
  // finest lattice.
  uint base = new_row.source_offset;
  for (uint level = new_row.level_min; level <= new_row.level_max; ++level) {
    const uint samples = lattice_samples(level);
    const float r = float(1u << level);
    const bool rest = level == new_row.level_max;
    for (uint e = thread; e < samples * 8u; e += 64u) {
      const uint s = e >> 3, c = e & 7u;
      uint x, y;
      lattice_point(s, x, y);
      const vec2 own = vec2(x, y) / r;
      const vec2 b = corner[2] + own.x * (corner[0] - corner[2]) + own.y * (corner[1] - corner[2]);
      float value = 0.0f;
      uint old_base = old_row.source_offset;
      for (uint l = old_row.level_min; l <= old_row.level_max; ++l) {
        if (l == level || rest) value += look_up(a.old_source, old_base, l, b, c);
        old_base += lattice_samples(l);
      }
      if (rest) {
        uint new_base = new_row.source_offset;
        for (uint l = new_row.level_min; l < level; ++l) {
          const LatticeCell cell = lattice_cell(own.x, own.y, l);
          value -=
              lattice_mix(cell, a.new_source.v[(new_base + cell.i0) * 8u + c],
                          a.new_source.v[(new_base + cell.i1) * 8u + c], a.new_source.v[(new_base + cell.i2) * 8u + c]);
          new_base += lattice_samples(l);
        }
      }
      a.new_source.v[(base + s) * 8u + c] = value;
    }
    base += samples;
    memoryBarrierBuffer();
    barrier();
  }
}
