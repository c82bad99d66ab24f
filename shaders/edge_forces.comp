// Vertex gradients from differences between neighbouring pixels (common/edges.h).
#include "common/kernel.h"
#include "args/edge_forces.h"
#include "common/coverage.h"
#include "common/pixel_centre.h"
#include "common/edges.h"
#include "common/fixed_point.h"
#include "common/tile.h"

ARGUMENTS(EdgeForcesArgs)

CONSTANT(0, bool, CLIP, false);  // keep the gradient in clip space: [views][T][3][4]

FN void add_vertex(TAKES_ARGUMENTS uint view, uint triangle, uint vertex, vec4 g) {
  if (CLIP) {
    const uint at = ((view * a.triangles + triangle) * 3u + vertex) * 4u;
    UNROLL for (uint i = 0u; i < 4u; ++i) add_fixed(a.vertex_low, at + i, a.vertex_high, at + i, g[i]);
    return;
  }
  const uint at = (triangle * 3u + vertex) * 3u;
  UNROLL for (uint i = 0u; i < 3u; ++i)
      add_fixed(a.vertex_low, at + i, a.vertex_high, at + i, dot(a.views.v[view].clip_from_world[i], g));
}

KERNEL_MAIN(64) {
  const uint tile = group_index(), thread = gl_LocalInvocationIndex;
  if (tile >= a.tiles) return;
  const uint view = tile_view(a.views, a.view_count, tile);
  const TilePixel pixel = tile_pixel(a.views, view, tile, thread);
  if (!pixel.inside) return;
  const Hit hit = a.hits.v[pixel.index];
  if (hit.triangle == 0u) return;

  const uint width = a.views.v[view].width, height = a.views.v[view].height;
  const vec2 size = vec2(width, height);
  const uint first = view * a.triangles;
  const uint own = first + hit.triangle - 1u;
  const vec4 a0 = a.screen.v[own].p0, a1 = a.screen.v[own].p1, a2 = a.screen.v[own].p2;
  const bool crosses = a.screen.v[own].crosses != 0u;
  const vec2 ndc = pixel_ndc(pixel.x, pixel.y, width, height);
  const vec3 colour =
      vec3(a.colour.v[pixel.index * 3u], a.colour.v[pixel.index * 3u + 1u], a.colour.v[pixel.index * 3u + 2u]);
  const vec3 gradient = vec3(a.gradient.v[pixel.index]);

  ClipGradient sum;
  sum.g0 = sum.g1 = sum.g2 = vec4(0.0f);
  for (int n = 0; n < 4; ++n) {
    const ivec2 step = n == 0 ? ivec2(-1, 0) : n == 1 ? ivec2(1, 0) : n == 2 ? ivec2(0, -1) : ivec2(0, 1);
    const ivec2 q = ivec2(pixel.x, pixel.y) + step;
    if (q.x < 0 || q.y < 0 || q.x >= int(width) || q.y >= int(height)) continue;
    const uint at = uint(int(pixel.index) + step.y * int(width) + step.x);
    const vec3 c = vec3(a.colour.v[at * 3u], a.colour.v[at * 3u + 1u], a.colour.v[at * 3u + 2u]);
    const vec3 g = vec3(a.gradient.v[at]);
    const float adjoint = 0.5f * dot(gradient + g, colour - c);
    if (adjoint == 0.0f) continue;
    const uint other = a.hits.v[at].triangle;
    const float other_depth = a.hits.v[at].depth;
    vec4 b0 = a0, b1 = a1, b2 = a2;
    if (other != 0u && other != hit.triangle) {
      b0 = a.screen.v[first + other - 1u].p0;
      b1 = a.screen.v[first + other - 1u].p1;
      b2 = a.screen.v[first + other - 1u].p2;
    }
    edge_force(a0, a1, a2, b0, b1, b2, crosses, other == hit.triangle, other == 0u, hit.depth, other_depth, ndc,
               pixel_ndc(uint(q.x), uint(q.y), width, height), adjoint * vec2(step) * 0.5f * size, step.y == 0, sum);
  }
  add_vertex(GIVES_ARGUMENTS view, hit.triangle - 1u, 0u, sum.g0);
  add_vertex(GIVES_ARGUMENTS view, hit.triangle - 1u, 1u, sum.g1);
  add_vertex(GIVES_ARGUMENTS view, hit.triangle - 1u, 2u, sum.g2);
}
