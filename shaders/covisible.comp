// Masks out the pixels of a view that fewer than two witnesses show unhidden. A witness shows the surface point of a
// pixel if its own pixel there is inside the mask and has the depth of the point. A pixel without a triangle is a point
// at infinity.
#include "common/kernel.h"
#include "args/covisible.h"
#include "common/block_grid.h"
#include "common/covisibility.h"
#include "common/photograph.h"
#include "common/pixel_centre.h"
#include "common/surface_point.h"

ARGUMENTS(CovisibleArgs)

/// Homogeneous coordinates of what a pixel shows.
FN vec4 shown_at(TAKES_ARGUMENTS uint view, uint x, uint y, uint index) {
  const uint triangle = a.hits.v[index].triangle;
  if (triangle != 0u) return vec4(surface_point(a.vertices, triangle, a.hits.v[index].b0, a.hits.v[index].b1), 1.0f);
  const vec2 ndc = pixel_ndc(x, y, a.views.v[view].width, a.views.v[view].height);
  // Rays point towards the camera.
  const vec4 ray = a.views.v[view].ray + ndc.x * a.views.v[view].ray_x + ndc.y * a.views.v[view].ray_y;
  return vec4(-vec3(ray), 0.0f);
}

/// Whether one of the four pixels around the point's place has its depth. A surface that fills less than a pixel of the
/// small depth image would be missed by a single one.
FN bool is_shown_by(TAKES_ARGUMENTS uint witness, vec4 point) {
  const mat4 m = a.witnesses.v[witness].clip_from_world;
  const vec4 clip = m * point;
  if (!(clip.w > 0.0f)) return false;
  const int width = int(a.witnesses.v[witness].width), height = int(a.witnesses.v[witness].height);
  const float x = (clip.x / clip.w * 0.5f + 0.5f) * float(width), y = (clip.y / clip.w * 0.5f + 0.5f) * float(height);
  if (!(x >= 0.0f && y >= 0.0f && x < float(width) && y < float(height))) return false;
  float expected = kNothingShown;
  if (point.w != 0.0f) expected = clip.w;
  const int left = int(floor(x - 0.5f)), top = int(floor(y - 0.5f));
  bool shown = false;
  UNROLL for (int j = 0; j < 2; ++j) {
    const uint row = a.witnesses.v[witness].pixel_offset + uint(clamp(top + j, 0, height - 1)) * uint(width);
    UNROLL for (int i = 0; i < 2; ++i) shown =
        shown || same_depth(a.depths.v[row + uint(clamp(left + i, 0, width - 1))], expected);
  }
  return shown;
}

KERNEL_MAIN(64) {
  const uint block = group_index(), thread = gl_LocalInvocationIndex;
  if (block >= a.blocks) return;
  const uint view = block_view(a.views, a.view_count, block);
  const uvec2 corner = block_corner(a.views, view, block);
  const uint width = a.views.v[view].width, height = a.views.v[view].height;
  const uint list = view * a.list_length, count = a.candidates.v[list];
  for (uint k = 0u; k < 4u; ++k) {
    const uvec2 at = block_pixel(corner, thread, k);
    if (at.x >= width || at.y >= height) continue;
    const uint index = a.views.v[view].pixel_offset + at.y * width + at.x, rgba = a.target.v[index];
    if (!in_mask(rgba)) continue;
    const vec4 point = shown_at(GIVES_ARGUMENTS view, at.x, at.y, index);
    uint witnesses = 0u;
    for (uint i = 0u; i < count && witnesses < 2u; ++i)
      if (is_shown_by(GIVES_ARGUMENTS a.candidates.v[list + 1u + i], point)) ++witnesses;
    if (witnesses < 2u) a.target.v[index] = rgba & 0x00ffffffu;
  }
}
