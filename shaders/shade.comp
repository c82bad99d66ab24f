// Colour of every pixel: features at the visible fragment, view direction, MLP, skip connection, background.
#include "common/kernel.h"
#include "args/shade.h"
#include "common/block_grid.h"
#include "common/pixel_centre.h"
#include "common/lattice.h"
#include "common/mlp_staging.h"
#include "common/pixel_lanes.h"
#include "common/shading.h"
#include "common/features.h"
#include "common/photograph.h"

ARGUMENTS(ShadeArgs)

CONSTANT(0, bool, DEBUG, false);    // also write the MLP's inputs
CONSTANT(1, bool, COARSER, false);  // use textures without their finest level

SHARED uint s_covered;

FN vec3 background_behind(TAKES_ARGUMENTS uint view) {
  return background_of(a.views.v[view].background, vec3(a.background_r, a.background_g, a.background_b));
}

FN void write_colour(TAKES_ARGUMENTS uint index, vec3 colour) {
  const uint at = index * 3u;
  a.colour.v[at] = colour.x;
  a.colour.v[at + 1u] = colour.y;
  a.colour.v[at + 2u] = colour.z;
}

/// Returns the first of this workgroup's blocks, starting at `block`, in which a triangle is visible, or a.blocks.
/// Fills the blocks it skips with the background. Uniform in the workgroup. A separate loop for the reason given in
/// shade_backward.comp.
FN uint next_covered(TAKES_ARGUMENTS uint block, uint thread) {
  for (; block < a.blocks; block += a.groups) {
    barrier();
    if (thread == 0u) s_covered = 0u;
    barrier();
    const uint view = block_view(a.views, a.view_count, block);
    const uvec2 corner = block_corner(a.views, view, block);
    UNROLL for (uint first = 0u; first < 4u; first += PIXELS) {
      Fragments p;
      load_fragments(a.views, view, corner, thread, first, a.hits, p);
      UNROLL for (uint k = 0u; k < PIXELS; ++k) if (p.triangle[k] != 0u) s_covered = 1u;
    }
    barrier();
    if (s_covered != 0u) break;
    UNROLL for (uint first = 0u; first < 4u; first += PIXELS) {
      Fragments p;
      load_fragments(a.views, view, corner, thread, first, a.hits, p);
      UNROLL for (uint k = 0u; k < PIXELS; ++k) if (p.inside[k])
          write_colour(GIVES_ARGUMENTS p.index[k], background_behind(GIVES_ARGUMENTS view));
    }
  }
  return block;
}

KERNEL_MAIN(64) {
  const uint group = group_index(), thread = gl_LocalInvocationIndex;
  if (group >= a.groups) return;
  stage_mlp(a.mlp, thread);
  uint block = next_covered(GIVES_ARGUMENTS group, thread);
  if (block < a.blocks) do {
      const uint view = block_view(a.views, a.view_count, block);
      const uvec2 corner = block_corner(a.views, view, block);
      ASK_FOR_FEATURES(0u);
      for (uint first = 0u; first < 4u; first += PIXELS) {
        Fragments p;
        load_fragments(a.views, view, corner, thread, first, a.hits, p);
        LANES x[16], h1[16], h2[16], y[3];
        mlp_inputs(a.views, view, corner, thread, first, a.hits, a.textures, a.lattice, COARSER, p, x);
        ASK_FOR_FEATURES(first + PIXELS);
        FORGET_WEIGHTS();
        mlp_forward(x, h1, h2, y);
        UNROLL for (uint k = 0u; k < PIXELS; ++k) {
          const float f[7] = {LANE(x[0], k), LANE(x[1], k), LANE(x[2], k), LANE(x[3], k),
                              LANE(x[4], k), LANE(x[5], k), LANE(x[6], k)};
          vec3 colour = background_behind(GIVES_ARGUMENTS view);
          if (p.triangle[k] != 0u) colour = skip_connection(f, vec3(LANE(y[0], k), LANE(y[1], k), LANE(y[2], k)));
          if (p.inside[k]) write_colour(GIVES_ARGUMENTS p.index[k], colour);
          if (DEBUG && p.inside[k])
            UNROLL for (uint i = 0u; i < 16u; ++i) a.debug.v[p.index[k] * 16u + i] = LANE(x[i], k);
        }
      }
      block = next_covered(GIVES_ARGUMENTS block + a.groups, thread);
    } while (block < a.blocks);
}
