// Depths of what views show, with which covisible.comp finds out whether they see a point.
#include "common/kernel.h"
#include "args/view_depths.h"
#include "common/block_grid.h"
#include "common/covisibility.h"
#include "common/photograph.h"
#include "common/surface_point.h"

KERNEL(64, ViewDepthsArgs) {
  const uint block = group_index(), thread = gl_LocalInvocationIndex;
  if (block >= a.blocks) return;
  const uint view = block_view(a.views, a.view_count, block);
  const uvec2 corner = block_corner(a.views, view, block);
  const uint width = a.views.v[view].width, height = a.views.v[view].height;
  const mat4 m = a.views.v[view].clip_from_world;
  for (uint k = 0u; k < 4u; ++k) {
    const uvec2 at = block_pixel(corner, thread, k);
    if (at.x >= width || at.y >= height) continue;
    const uint index = a.views.v[view].pixel_offset + at.y * width + at.x, triangle = a.hits.v[index].triangle;
    float depth = kNothingShown;
    if (triangle != 0u) {
      const vec4 clip = m * vec4(surface_point(a.vertices, triangle, a.hits.v[index].b0, a.hits.v[index].b1), 1.0f);
      depth = clip.w;
    }
    if (!in_mask(a.masks.v[index])) depth = 0.0f;
    a.depths.v[index] = depth;
  }
}
