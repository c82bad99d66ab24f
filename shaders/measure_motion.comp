// Adds up how far each camera of a batch must move for its picture to fit the photograph (common/camera_motion.h).
// Skips pixels without a triangle, masked-out pixels and borders of surfaces, where pictures change otherwise.
#include "common/kernel.h"
#include "args/measure_motion.h"
#include "common/block_grid.h"
#include "common/camera_motion.h"
#include "common/fixed_point.h"
#include "common/photograph.h"
#include "common/surface_point.h"

ARGUMENTS(MeasureMotionArgs)

SHARED vec4 s_motion[64 * MOTION_SUMS];

FN vec3 picture_at(TAKES_ARGUMENTS uint index) {
  return vec3(a.colour.v[index * 3u], a.colour.v[index * 3u + 1u], a.colour.v[index * 3u + 2u]);
}

FN vec3 photograph_at(TAKES_ARGUMENTS uint index) {
  const uint rgba = a.target.v[index];
  return vec3(float(rgba & 255u), float((rgba >> 8) & 255u), float((rgba >> 16) & 255u)) * (1.0f / 255.0f);
}

/// Whether a neighbour shows the same surface: inside the mask, with about the same distance.
FN bool continues(TAKES_ARGUMENTS uint index, uint beside) {
  const float here = 1.0f - a.hits.v[index].depth, there = 1.0f - a.hits.v[beside].depth;
  return a.hits.v[beside].triangle != 0u && in_mask(a.target.v[beside]) && abs(here - there) <= 0.1f * abs(here);
}

FN void add_pixel(TAKES_ARGUMENTS uint view, uint x, uint y, INOUT_ARRAY_OF(vec4, sums, MOTION_SUMS)) {
  const uint width = a.views.v[view].width, height = a.views.v[view].height;
  if (x == 0u || y == 0u || x + 1u >= width || y + 1u >= height) return;
  const uint index = a.views.v[view].pixel_offset + y * width + x, triangle = a.hits.v[index].triangle;
  if (triangle == 0u || !in_mask(a.target.v[index])) return;
  if (!continues(GIVES_ARGUMENTS index, index - 1u) || !continues(GIVES_ARGUMENTS index, index + 1u) ||
      !continues(GIVES_ARGUMENTS index, index - width) || !continues(GIVES_ARGUMENTS index, index + width))
    return;
  const mat4 m = a.views.v[view].clip_from_world;
  const vec3 point = surface_point(a.vertices, triangle, a.hits.v[index].b0, a.hits.v[index].b1);
  const float w = (m * vec4(point, 1.0f)).w;
  if (!(w > 0.0f)) return;
  const vec2 half_size = vec2(0.5f * float(width), 0.5f * float(height));
  const vec2 ndc = vec2((float(x) + 0.5f) / half_size.x - 1.0f, (float(y) + 0.5f) / half_size.y - 1.0f);
  const PixelMotion motion = pixel_motion(point, vec3(m[0][0], m[1][0], m[2][0]), vec3(m[0][1], m[1][1], m[2][1]),
                                          vec3(m[0][3], m[1][3], m[2][3]), ndc, w, half_size);
  const vec3 right = picture_at(GIVES_ARGUMENTS index + 1u) - picture_at(GIVES_ARGUMENTS index - 1u) +
                     photograph_at(GIVES_ARGUMENTS index + 1u) - photograph_at(GIVES_ARGUMENTS index - 1u);
  const vec3 down = picture_at(GIVES_ARGUMENTS index + width) - picture_at(GIVES_ARGUMENTS index - width) +
                    photograph_at(GIVES_ARGUMENTS index + width) - photograph_at(GIVES_ARGUMENTS index - width);
  add_to_motion(motion, picture_at(GIVES_ARGUMENTS index) - photograph_at(GIVES_ARGUMENTS index), 0.25f * right,
                0.25f * down, a.views.v[view].photograph_pixels, sums);
}

FN void measure_block(TAKES_ARGUMENTS uint block, uint thread) {
  const uint view = block_view(a.views, a.view_count, block);
  const uvec2 corner = block_corner(a.views, view, block);
  vec4 sums[MOTION_SUMS];
  UNROLL for (uint i = 0u; i < MOTION_SUMS; ++i) sums[i] = vec4(0.0f);
  for (uint k = 0u; k < 4u; ++k) {
    const uvec2 at = block_pixel(corner, thread, k);
    if (at.y < a.views.v[view].height) add_pixel(GIVES_ARGUMENTS view, at.x, at.y, sums);
  }
  UNROLL for (uint i = 0u; i < MOTION_SUMS; ++i) s_motion[thread * MOTION_SUMS + i] = sums[i];
  barrier();
  if (thread < 4u * MOTION_SUMS) {
    float sum = 0.0f;
    for (uint i = 0u; i < 64u; ++i) sum += s_motion[i * MOTION_SUMS + thread / 4u][thread % 4u];
    const uint at = a.views.v[view].index * 4u * MOTION_SUMS + thread;
    const float pixels = float(a.views.v[view].width) * float(a.views.v[view].height);
    add_fixed(a.sums_low, at, a.sums_high, at, sum * (MOTION_UNIT / pixels));
  }
  barrier();
}

KERNEL_MAIN(64) {
  const uint group = group_index();
  if (group >= a.groups) return;
  if (a.control.v[0].overflow != 0u) return;  // this step will be repeated
  for (uint block = group; block < a.blocks; block += a.groups)
    measure_block(GIVES_ARGUMENTS block, gl_LocalInvocationIndex);
}
