// Produces the output of shade_backward.comp for update_textures.comp if the pixels were shaded on another device.
#include "common/kernel.h"
#include "args/sort_gradients.h"

KERNEL(64, SortGradientsArgs) {
  const uint i = thread_index();
  if (i >= a.pixels) return;
  const uint hit = a.hits.v[i].triangle;
  if (hit == 0u || hit - 1u < a.first || hit - 1u >= a.last) return;
  const uint place = a.places.v[hit - 1u] + a.ranks.v[i];
  UNROLL for (uint c = 0u; c < 7u; ++c) a.sorted.v[c * a.pixels + place] = a.gradient.v[c * a.pixels + i];
  a.sorted.v[7u * a.pixels + place] = a.hits.v[i].b0;
  a.sorted.v[8u * a.pixels + place] = a.hits.v[i].b1;
}
