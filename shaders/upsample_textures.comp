// Coarse to fine, as in DiffSoup: the coarsest new level starts with the old texture sampled at its points, finer
// levels start at zero. One workgroup per triangle.
#include "common/kernel.h"
#include "args/upsample_textures.h"
#include "common/lattice.h"

KERNEL(64, UpsampleTexturesArgs) {
  const uint triangle = group_index();
  if (triangle >= a.triangles) return;
  const Texture old_row = a.old_textures.v[triangle], new_row = a.new_textures.v[triangle];
  uint samples = 0u;
  for (uint l = new_row.level_min; l <= new_row.level_max; ++l) samples += lattice_samples(l);
  const uint first = lattice_samples(new_row.level_min), r = 1u << new_row.level_min;
  for (uint e = gl_LocalInvocationIndex; e < samples * 8u; e += 64u) {
    const uint s = e >> 3, c = e & 7u;
    float value = 0.0f;
    if (s < first && (c != 7u || a.keep_opacity != 0u)) {
      uint x, y;
      lattice_point(s, x, y);
      uint base = old_row.source_offset;
      for (uint l = old_row.level_min; l <= old_row.level_max; ++l) {
        const LatticeCell cell = lattice_cell(float(x) / float(r), float(y) / float(r), l);
        value += lattice_mix(cell, a.old_source.v[(base + cell.i0) * 8u + c], a.old_source.v[(base + cell.i1) * 8u + c],
                             a.old_source.v[(base + cell.i2) * 8u + c]);
        base += lattice_samples(l);
      }
    }
    a.new_source.v[(new_row.source_offset + s) * 8u + c] = value;
  }
}
