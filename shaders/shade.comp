// Colour of every pixel: features at the visible fragment, view direction, MLP, skip connection, background.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/glsl.h"
#include "args/shade.h"
#include "common/block_grid.h"
#include "common/coverage.h"
#include "common/lattice.h"
#include "common/mlp_staging.h"
#include "common/shading.h"
#include "common/features.h"

layout(local_size_x = 64) in;
layout(constant_id = 0) const bool DEBUG = false;  // also write the MLP's inputs
layout(push_constant) uniform Push { ShadeArgs a; };

shared uint s_covered;

void main() {
  const uint block = group_index(), thread = gl_LocalInvocationIndex;
  if (block >= a.blocks) return;
  if (thread == 0u) s_covered = 0u;
  barrier();
  const uint view = block_view(a.views, a.view_count, block);
  const uvec2 corner = block_corner(a.views, view, block);
  Fragments p;
  load_fragments(a.views, view, corner, thread, a.hits, p);
  if ((p.triangle[0] | p.triangle[1] | p.triangle[2] | p.triangle[3]) != 0u) s_covered = 1u;
  barrier();

  vec3 colour[4];
  UNROLL for (uint k = 0u; k < 4u; ++k) colour[k] = vec3(a.background_r, a.background_g, a.background_b);
  // Uniform in the workgroup: empty blocks cost next to nothing.
  if (s_covered != 0u) {
    stage_mlp(a.mlp, thread);
    vec4 x[16], h1[16], h2[16], y[3];
    mlp_inputs(a.views, view, corner, thread, a.hits, a.textures, a.lattice, p, x);
    barrier();
    mlp_forward(x, h1, h2, y);
    UNROLL for (uint k = 0u; k < 4u; ++k) {
      const float f[7] = float[7](x[0][k], x[1][k], x[2][k], x[3][k], x[4][k], x[5][k], x[6][k]);
      if (p.triangle[k] != 0u) colour[k] = skip_connection(f, vec3(y[0][k], y[1][k], y[2][k]));
      if (DEBUG && p.inside[k]) UNROLL for (uint i = 0u; i < 16u; ++i) a.debug.v[p.index[k] * 16u + i] = x[i][k];
    }
  }
  UNROLL for (uint k = 0u; k < 4u; ++k)
    if (p.inside[k]) {
      const uint at = p.index[k] * 3u;
      a.colour.v[at] = colour[k].x;
      a.colour.v[at + 1u] = colour[k].y;
      a.colour.v[at + 2u] = colour[k].z;
    }
}
