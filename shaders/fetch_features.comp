// Texture lookup only: the features that shade.comp would use at each pixel's visible fragment, for shading on another
// device.
#include "common/kernel.h"
#include "args/fetch_features.h"
#include "common/lattice.h"
#include "common/fragment_features.h"

KERNEL(64, FetchFeaturesArgs) {
  const uint i = thread_index();
  if (i >= a.pixels) return;
  const uint hit = a.hits.v[i].triangle;
  if (hit == 0u || hit - 1u < a.first || hit - 1u >= a.last) return;
  LatticeCell cell;
  if (a.coarser != 0u)
    cell = coarser_cell(a.hits.v[i].b0, a.hits.v[i].b1, a.textures.v[hit - 1u].level_max);
  else
    cell = lattice_cell(a.hits.v[i].b0, a.hits.v[i].b1, a.textures.v[hit - 1u].level_max);
  float f[7];
  fragment_features(a.lattice, a.textures.v[hit - 1u].lattice_offset, cell, f);
  a.features.v[2u * i] = vec4(f[0], f[1], f[2], f[3]);
  a.features.v[2u * i + 1u] = vec4(f[4], f[5], f[6], 0.0f);
}
