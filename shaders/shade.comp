// Colour of every pixel: features at the visible fragment, view direction, MLP, skip connection, background.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/glsl.h"
#include "args/shade.h"
#include "common/coverage.h"
#include "common/lattice.h"
#include "common/mlp_staging.h"
#include "common/shading.h"
#include "common/tile.h"
#include "common/features.h"

layout(local_size_x = 64) in;
layout(constant_id = 0) const bool DEBUG = false;  // also write the MLP's inputs
layout(push_constant) uniform Push { ShadeArgs a; };

shared uint s_covered;

void main() {
  const uint tile = group_index(), thread = gl_LocalInvocationIndex;
  if (tile >= a.tiles) return;
  if (thread == 0u) s_covered = 0u;
  barrier();
  const uint view = tile_view(a.views, a.view_count, tile);
  const TilePixel pixel = tile_pixel(a.views, view, tile, thread);
  Hit hit;
  hit.triangle = 0u;
  if (pixel.inside) hit = a.hits.v[pixel.index];
  if (hit.triangle != 0u) s_covered = 1u;
  barrier();

  vec3 colour = vec3(a.background_r, a.background_g, a.background_b);
  float x[16];
  UNROLL for (int i = 0; i < 16; ++i) x[i] = 0.0;
  // Uniform in the workgroup: empty tiles are free.
  if (s_covered != 0u) {
    stage_mlp(a.mlp, thread);
    if (hit.triangle != 0u) {
      const Texture row = a.textures.v[hit.triangle - 1u];
      fragment_features(a.lattice, row.lattice_offset, lattice_cell(hit.b0, hit.b1, row.level_max), x);
      view_inputs(a.views, view, pixel.x, pixel.y, x);
    }
    barrier();
    float h1[16], h2[16];
    vec3 y;
    mlp_forward(x, h1, h2, y);
    if (hit.triangle != 0u) {
      const float f[7] = float[7](x[0], x[1], x[2], x[3], x[4], x[5], x[6]);
      colour = skip_connection(f, y);
    }
  }
  if (!pixel.inside) return;
  a.colour.v[pixel.index * 3u] = colour.x;
  a.colour.v[pixel.index * 3u + 1u] = colour.y;
  a.colour.v[pixel.index * 3u + 2u] = colour.z;
  if (DEBUG) UNROLL for (uint i = 0u; i < 16u; ++i) a.debug.v[pixel.index * 16u + i] = x[i];
}
