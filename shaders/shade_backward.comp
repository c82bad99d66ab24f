// dL/dC through skip connection and MLP. Feature gradients are stored for update_textures, sorted by triangle. MLP
// gradients are summed in registers; each workgroup processes every groups-th block, so that its sums always have the
// same terms in the same order.
#include "common/kernel.h"
#include "args/shade_backward.h"
#include "common/block_grid.h"
#include "common/exposure.h"
#include "common/exposure_table.h"
#include "common/pixel_centre.h"
#include "common/lattice.h"
#include "common/mlp_staging.h"
#include "common/pixel_lanes.h"
#include "common/shading.h"
#include "common/features.h"
#include "common/mlp_sums.h"

ARGUMENTS(ShadeBackwardArgs)

CONSTANT(0, bool, DEBUG, false);  // also write dL/dfeature

SHARED uint s_covered[4];  // per quarter of the block

/// Returns the first of this workgroup's blocks, starting at `block`, in which a triangle is visible, or a.blocks.
/// Fills s_covered. Uniform in the workgroup. Empty blocks are skipped in a separate loop: where branches are masks
/// (llvmpipe), skipping them in the main loop would cost all of its arithmetic.
FN uint next_covered(TAKES_ARGUMENTS uint block, uint thread) {
  for (; block < a.blocks; block += a.groups) {
    barrier();
    if (thread < 4u) s_covered[thread] = 0u;
    barrier();
    const uint view = block_view(a.views, a.view_count, block);
    const uvec2 corner = block_corner(a.views, view, block);
    UNROLL for (uint first = 0u; first < 4u; first += PIXELS) {
      Fragments p;
      load_fragments(a.views, view, corner, thread, first, a.hits, p);
      UNROLL for (uint k = 0u; k < PIXELS; ++k) if (p.triangle[k] != 0u) s_covered[first + k] = 1u;
    }
    barrier();
    if ((s_covered[0] | s_covered[1] | s_covered[2] | s_covered[3]) != 0u) break;
  }
  return block;
}

KERNEL_MAIN(64) {
  const uint group = group_index(), thread = gl_LocalInvocationIndex;
  if (group >= a.groups) return;
  stage_mlp(a.mlp, thread);

  MlpSums sums;
  clear_sums(sums);
  uint block = next_covered(GIVES_ARGUMENTS group, thread);
  if (block < a.blocks) do {
      const uint view = block_view(a.views, a.view_count, block);
      const uvec2 corner = block_corner(a.views, view, block);
      ASK_FOR_FEATURES(0u);
      for (uint first = 0u; first < 4u; first += PIXELS) {
        if (PIXELS == 1 && s_covered[first] == 0u) continue;
        Fragments p;
        load_fragments(a.views, view, corner, thread, first, a.hits, p);
        LANES x[16], h1[16], h2[16], y[3], dy[3], d1[16], d2[16], d3[3], dx[7], dmix = LANES(0.0f), drgb[3];
        UNROLL for (int c = 0; c < 3; ++c) dy[c] = drgb[c] = LANES(0.0f);
        mlp_inputs(a.views, view, corner, thread, first, a.hits, a.textures, a.lattice, false, p, x);
        ASK_FOR_FEATURES(first + PIXELS);
        mlp_forward(x, h1, h2, y);
        // Pixels without a fragment have a zero gradient and do not contribute to any sum.
        UNROLL for (uint k = 0u; k < PIXELS; ++k) if (p.triangle[k] != 0u) {
          const float f[7] = {LANE(x[0], k), LANE(x[1], k), LANE(x[2], k), LANE(x[3], k),
                              LANE(x[4], k), LANE(x[5], k), LANE(x[6], k)};
          const vec3 own_y = vec3(LANE(y[0], k), LANE(y[1], k), LANE(y[2], k));
          vec3 dc = vec3(a.gradient.v[p.index[k]]), own_dy, own_drgb;
          float own_dmix;
          if (a.exposed != 0u) {
            const uvec2 at = block_pixel(corner, thread, first + k);
            dc = exposed_backward(exposure_at(a.exposure, a.views.v[view].index, at.x, at.y, a.views.v[view].width,
                                              a.views.v[view].height),
                                  skip_connection(f, own_y), dc);
          }
          skip_connection_backward(f, own_y, dc, own_dy, own_drgb, own_dmix);
          UNROLL for (uint c = 0u; c < 3u; ++c) {
            LANE(dy[c], k) = own_dy[c];
            LANE(drgb[c], k) = own_drgb[c];
          }
          LANE(dmix, k) = own_dmix;
        }
        FORGET_WEIGHTS();
        mlp_backward(h1, h2, y, dy, d1, d2, d3, dx);
        UNROLL for (int c = 0; c < 3; ++c) dx[c] += drgb[c];
        dx[3] += dmix;

        UNROLL for (uint k = 0u; k < PIXELS; ++k) {
          if (p.triangle[k] != 0u) {
            const uint place = a.places.v[p.triangle[k] - 1u] + a.ranks.v[p.index[k]];
            UNROLL for (uint c = 0u; c < 7u; ++c) a.sorted.v[c * a.pixels + place] = LANE(dx[c], k);
            a.sorted.v[7u * a.pixels + place] = a.hits.v[p.index[k]].b0;
            a.sorted.v[8u * a.pixels + place] = a.hits.v[p.index[k]].b1;
          }
          if (DEBUG && p.inside[k])
            UNROLL for (uint c = 0u; c < 7u; ++c) a.debug.v[p.index[k] * 7u + c] = LANE(dx[c], k);
        }

        UNROLL for (uint k = 0u; k < PIXELS; ++k) {
          if (s_covered[first + k] == 0u) continue;
          barrier();
          PUT_PIXEL(x, h1, h2, d1, d2, d3, k);
          barrier();
          add_pixels(thread, sums);
        }
      }
      block = next_covered(GIVES_ARGUMENTS block + a.groups, thread);
    } while (block < a.blocks);

  write_sums(a.mlp_partial, group * MLP_COUNT, thread, sums);
}
