// Vertex gradients from depth maps: moves the plane of each pixel's triangle towards the measured depth
// (common/depth.h). Pixels without a measurement, at edges of the map and outside the loss mask have none.
#include "common/kernel.h"
#include "args/depth_gradient.h"
#include "common/coverage.h"
#include "common/pixel_centre.h"
#include "common/edges.h"
#include "common/depth.h"
#include "common/fixed_point.h"
#include "common/tile.h"

ARGUMENTS(DepthGradientArgs)

/// Offset of a view's samples from pixel centres along an axis, which its taps hold (args/types.h).
FN float sample_offset(int first, vec4 taps) { return float(first + 1) - taps.x + taps.z + 2.0f * taps.w; }

/// Inverse depth that the map has at a pixel's sample; 0: none.
FN float measured_at(TAKES_ARGUMENTS uint view, uint x, uint y) {
  const uint size = a.views.v[view].depth_size;
  const int width = int(size & 0xffffu), height = int(size >> 16);
  const float u = float(x) + 0.5f + sample_offset(a.views.v[view].first_x, a.views.v[view].taps_x),
              v = float(y) + 0.5f + sample_offset(a.views.v[view].first_y, a.views.v[view].taps_y);
  const float column = u * float(width) / float(a.views.v[view].width) - 0.5f,
              row = v * float(height) / float(a.views.v[view].height) - 0.5f;
  const float left = floor(column), top = floor(row);
  const int x0 = clamp(int(left), 0, width - 1), x1 = clamp(int(left) + 1, 0, width - 1);
  const int y0 = clamp(int(top), 0, height - 1) * width, y1 = clamp(int(top) + 1, 0, height - 1) * width;
  Floats map = a.views.v[view].depth;
  return between_depths(map.v[uint(y0 + x0)], map.v[uint(y0 + x1)], map.v[uint(y1 + x0)], map.v[uint(y1 + x1)],
                        column - left, row - top);
}

/// Whether the plane passes too close to the camera. normal: of DepthPlane, in clip space.
FN bool is_flat(TAKES_ARGUMENTS uint view, vec3 normal, float inverse) {
  const vec4 n = vec4(normal.x, normal.y, 0.0f, normal.z);
  vec3 world;
  UNROLL for (uint i = 0u; i < 3u; ++i) world[i] = dot(a.views.v[view].clip_from_world[i], n);
  return inverse < kFlattestPlane * sqrt(dot(world, world));
}

FN void add_vertex(TAKES_ARGUMENTS uint view, uint vertex, vec4 g) {
  UNROLL for (uint i = 0u; i < 3u; ++i) add_fixed(a.vertex_low, vertex * 3u + i, a.vertex_high, vertex * 3u + i,
                                                  dot(a.views.v[view].clip_from_world[i], g));
}

KERNEL_MAIN(64) {
  const uint tile = group_index(), thread = gl_LocalInvocationIndex;
  const float weight = a.state.v[0].depth_weight;
  if (tile >= a.tiles || weight == 0.0f) return;
  const uint view = tile_view(a.views, a.view_count, tile);
  if (a.views.v[view].depth_size == 0u) return;
  const TilePixel pixel = tile_pixel(a.views, view, tile, thread);
  if (!pixel.inside) return;
  const uint triangle = a.hits.v[pixel.index].triangle;
  if (triangle == 0u || a.gradient.v[pixel.index].w < 0.0f) return;
  const float measured = measured_at(GIVES_ARGUMENTS view, pixel.x, pixel.y);
  if (measured == 0.0f) return;

  const uint own = view * a.triangles + triangle - 1u;
  const DepthPlane plane = depth_plane(a.screen.v[own].p0, a.screen.v[own].p1, a.screen.v[own].p2,
                                       pixel_ndc(pixel.x, pixel.y, a.views.v[view].width, a.views.v[view].height));
  if (!plane.valid || is_flat(GIVES_ARGUMENTS view, plane.normal, plane.inverse)) return;
  ClipGradient sum;
  sum.g0 = sum.g1 = sum.g2 = vec4(0.0f);
  add_depth_gradient(plane, weight * depth_loss_slope(plane.inverse, measured), sum);
  add_vertex(GIVES_ARGUMENTS view, (triangle - 1u) * 3u, sum.g0);
  add_vertex(GIVES_ARGUMENTS view, (triangle - 1u) * 3u + 1u, sum.g1);
  add_vertex(GIVES_ARGUMENTS view, (triangle - 1u) * 3u + 2u, sum.g2);
}
