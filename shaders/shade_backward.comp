// dL/dC through skip connection and MLP: feature gradients go to the lattice (fixed point), MLP gradients are summed in
// registers. A workgroup takes every groups-th tile, so that its sums always hold the same terms in the same order.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/glsl.h"
#include "args/shade_backward.h"
#include "common/coverage.h"
#include "common/fixed_point.h"
#include "common/lattice.h"
#include "common/mlp_staging.h"
#include "common/shading.h"
#include "common/tile.h"
#include "common/features.h"

layout(local_size_x = 64) in;
layout(constant_id = 0) const bool DEBUG = false;  // also write dL/dfeature
layout(push_constant) uniform Push { ShadeBackwardArgs a; };

shared uint s_covered;
// Rows of 64 pixels: inputs x, h1, h2 (4 rows of 4 each), then deltas d1, d2 (4 rows each) and d3 (1 row).
shared vec4 s_row[21 * 64];
const uint kX = 0u, kH1 = 4u, kH2 = 8u, kD1 = 12u, kD2 = 16u, kD3 = 20u;

void put(uint row, uint thread, float v[16]) {
  UNROLL for (uint i = 0u; i < 4u; ++i)
    s_row[(row + i) * 64u + thread] = vec4(v[4u * i], v[4u * i + 1u], v[4u * i + 2u], v[4u * i + 3u]);
}

void main() {
  const uint group = group_index(), thread = gl_LocalInvocationIndex;
  if (group >= a.groups) return;
  stage_mlp(a.mlp, thread);

  // Threads 0..35 own a 4 x 4 block of a weight matrix each: 16 of w1, 16 of w2, 4 of w3.
  const uint layer = thread < 16u ? 0u : thread < 32u ? 1u : 2u;
  const uint in_block = thread & 3u;
  const uint out_block = layer == 2u ? 0u : (thread >> 2) & 3u;
  const uint delta_row = (layer == 0u ? kD1 : layer == 1u ? kD2 : kD3) + out_block;
  const uint input_row = (layer == 0u ? kX : layer == 1u ? kH1 : kH2) + in_block;
  mat4 weights = mat4(0.0);  // column: output
  vec4 biases = vec4(0.0);

  for (uint tile = group; tile < a.tiles; tile += a.groups) {
    barrier();
    if (thread == 0u) s_covered = 0u;
    barrier();
    const uint view = tile_view(a.views, a.view_count, tile);
    const TilePixel pixel = tile_pixel(a.views, view, tile, thread);
    Hit hit;
    hit.triangle = 0u;
    if (pixel.inside) hit = a.hits.v[pixel.index];
    if (hit.triangle != 0u) s_covered = 1u;
    barrier();
    if (s_covered == 0u) continue;

    float x[16], h1[16], h2[16], d1[16], d2[16], dx[7];
    vec3 y, dy, d3, drgb, dc = vec3(0.0);
    float dmix;
    UNROLL for (int i = 0; i < 16; ++i) x[i] = 0.0;
    LatticeCell cell;
    uint lattice_offset = 0u;
    if (hit.triangle != 0u) {
      const Texture row = a.textures.v[hit.triangle - 1u];
      lattice_offset = row.lattice_offset;
      cell = lattice_cell(hit.b0, hit.b1, row.level_max);
      fragment_features(a.lattice, lattice_offset, cell, x);
      view_inputs(a.views, view, pixel.x, pixel.y, x);
      dc = vec3(a.gradient.v[pixel.index * 4u], a.gradient.v[pixel.index * 4u + 1u], a.gradient.v[pixel.index * 4u + 2u]);
    }
    mlp_forward(x, h1, h2, y);
    const float f[7] = float[7](x[0], x[1], x[2], x[3], x[4], x[5], x[6]);
    skip_connection_backward(f, y, dc, dy, drgb, dmix);
    mlp_backward(h1, h2, y, dy, d1, d2, d3, dx);
    dx[0] += drgb.x;
    dx[1] += drgb.y;
    dx[2] += drgb.z;
    dx[3] += dmix;
    if (hit.triangle != 0u) {
      const uint i0 = (lattice_offset + cell.i0) * 8u, i1 = (lattice_offset + cell.i1) * 8u,
                 i2 = (lattice_offset + cell.i2) * 8u;
      UNROLL for (uint c = 0u; c < 7u; ++c) {
        add_fixed(a.gradient_low, i0 + c, a.gradient_high, i0 + c, cell.w0 * dx[c]);
        add_fixed(a.gradient_low, i1 + c, a.gradient_high, i1 + c, cell.w1 * dx[c]);
        add_fixed(a.gradient_low, i2 + c, a.gradient_high, i2 + c, cell.w2 * dx[c]);
      }
    }
    if (DEBUG && pixel.inside)
      UNROLL for (uint c = 0u; c < 7u; ++c) a.debug.v[pixel.index * 7u + c] = hit.triangle != 0u ? dx[c] : 0.0;

    // Pixels without a fragment have d = 0 and add nothing.
    put(kX, thread, x);
    put(kH1, thread, h1);
    put(kH2, thread, h2);
    put(kD1, thread, d1);
    put(kD2, thread, d2);
    s_row[kD3 * 64u + thread] = vec4(d3, 0.0);
    barrier();
    if (thread < 36u)
      for (uint p = 0u; p < 64u; ++p) {
        const vec4 delta = s_row[delta_row * 64u + p];
        weights += outerProduct(s_row[input_row * 64u + p], delta);
        biases += delta;
      }
  }

  if (thread >= 36u) return;
  const uint base = group * 595u + (layer == 0u ? 0u : layer == 1u ? MLP_W2 : MLP_W3);
  const uint bias = group * 595u + (layer == 0u ? MLP_B1 : layer == 1u ? MLP_B2 : MLP_B3);
  for (uint o = 0u; o < (layer == 2u ? 3u : 4u); ++o) {
    for (uint i = 0u; i < 4u; ++i) a.mlp_partial.v[base + (out_block * 4u + o) * 16u + in_block * 4u + i] = weights[o][i];
    if (in_block == 0u) a.mlp_partial.v[bias + out_block * 4u + o] = biases[o];
  }
}
