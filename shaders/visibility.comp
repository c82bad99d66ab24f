// Visibility with stochastic opacity masking (DiffSoup, section 4.1): finds the nearest fragment whose opacity reaches
// its threshold.
#include "common/kernel.h"
#include "args/visibility.h"
#include "common/coverage.h"
#include "common/pixel_centre.h"
#include "common/lattice.h"
#include "common/random.h"
#include "common/tile.h"
#include "common/staging.h"

// 0: 0.5 everywhere (inference); 1: a random number per fragment (training); 2: from a buffer.
CONSTANT(0, uint, THRESHOLDS, 0u);
// 0: the nearest fragment; 1: the nearest of a triangle other than that in a.first; 2: the nearest, with opacities one
// level coarser.
CONSTANT(1, uint, LAYER, 0u);

KERNEL(64, VisibilityArgs) {
  if (group_index() >= a.tiles) return;
  const uint tile = a.tile_first + group_index(), thread = gl_LocalInvocationIndex;
  const uint view = tile_view(a.views, a.view_count, tile);
  const TilePixel pixel = tile_pixel(a.views, view, tile, thread);
  const vec2 origin = tile_origin(a.views, view, tile);
  const vec2 d = pixel_ndc(pixel.x, pixel.y, a.views.v[view].width, a.views.v[view].height) - origin;
  const uint first = min(a.offsets.v[tile], a.capacity), last = min(a.offsets.v[tile + 1u], a.capacity);

  uint pixel_hash = 0u;
  if (THRESHOLDS == 1u)
    pixel_hash = threshold_pixel(hash32(a.state.v[0].threshold_key ^ (a.views.v[view].index * 0x9e3779b9u)),
                                 (pixel.y << 16) | pixel.x);

  Hit hit;
  hit.triangle = 0u;
  hit.b0 = hit.b1 = hit.depth = 0.0f;
  float best = 1.0f;  // the far plane
  uint skipped = 0u;
  if (LAYER == 1u && pixel.inside) skipped = a.first.v[pixel.index].triangle;
  for (uint base = first; base < last; base += 64u) {
    barrier();
    if (base + thread < last)
      stage_triangle(thread, a.lists.v[base + thread], a.screen, view * a.triangles, a.textures, origin);
    barrier();
    const uint count = min(64u, last - base);
    for (uint first_slot = 0u; first_slot < count; first_slot += 32u) {
      for (uint bits = covering(first_slot, count, d, best, 0xffffffffu); bits != 0u; bits &= bits - 1u) {
        const uint k = first_slot + uint(findLSB(bits));
        const float e0 = at_offset(vec3(s_e0[k]), d), e1 = at_offset(vec3(s_e1[k]), d),
                    e2 = at_offset(vec3(s_e2[k]), d);
        const float depth = at_offset(vec3(s_plane[k]), d), sum = e0 + e1 + e2;
        const uvec4 row = s_texture[k];
        // Lists have no defined order, so equal depths go to the lower index.
        const bool nearer = depth < best || (depth == best && (hit.triangle == 0u || row.z + 1u < hit.triangle));
        if (!nearer) continue;
        if (LAYER == 1u && row.z + 1u == skipped) continue;
        const float b0 = e0 / sum, b1 = e1 / sum;
        LatticeCell cell;
        if (LAYER == 2u)
          cell = coarser_cell(b0, b1, row.y);
        else
          cell = lattice_cell(b0, b1, row.y);
        const float alpha = opacity_at(a.opacity, row, cell);
        float threshold = 0.5f;
        if (THRESHOLDS == 1u) threshold = threshold_of(pixel_hash, row.z);
        if (THRESHOLDS == 2u && pixel.inside) threshold = a.thresholds.v[pixel.index * a.triangles + row.z];
        if (alpha >= threshold) {
          best = depth;
          hit.triangle = row.z + 1u;
          hit.b0 = b0;
          hit.b1 = b1;
          hit.depth = depth;
        }
      }
    }
  }
  if (pixel.inside) a.hits.v[pixel.index] = hit;
}
