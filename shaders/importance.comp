// Importance: the increase of the weighted squared error without each triangle, or without the finest level of its
// texture (engine/train/topology/importance.h).
#include "common/kernel.h"
#include "args/importance.h"
#include "common/fixed_point.h"
#include "common/block_grid.h"

ARGUMENTS(ImportanceArgs)

CONSTANT(0, bool, FIRST, false);  // the unchanged rendering, with which the others are compared

SHARED float s_sum[64];

/// Half constant, like PSNR, and half the lack of contrast, like SSIM. The mean over a view's pixels is 1.
FN float error_weight(TAKES_ARGUMENTS uint view, uint index) {
  const float flatness = a.flatness.v[index];
  const float total = 1024.0f * from_fixed(a.contrast.v[view * 4u], a.contrast.v[view * 4u + 1u]);
  return flatness > 0.0f ? 0.5f + 0.5f * flatness * float(a.contrast.v[view * 4u + 2u]) / total : 0.0f;
}

KERNEL_MAIN(64) {
  const uint block = group_index(), thread = gl_LocalInvocationIndex;
  if (block >= a.blocks) return;
  const uint view = block_view(a.views, a.view_count, block);
  const uvec2 corner = block_corner(a.views, view, block);
  const uint width = a.views.v[view].width, height = a.views.v[view].height;
  const uint pixel_offset = a.views.v[view].pixel_offset;
  float sum = 0.0f;
  for (uint k = 0u; k < 4u; ++k) {
    const uvec2 at = block_pixel(corner, thread, k);
    if (at.x >= width || at.y >= height) continue;
    const uint index = pixel_offset + at.y * width + at.x, rgba = a.target.v[index], shown = a.first.v[index].triangle;
    if (!FIRST && shown == 0u) continue;
    float squares = 0.0f;
    UNROLL for (uint c = 0u; c < 3u; ++c) {
      const float d = a.colour.v[index * 3u + c] - float((rgba >> (8u * c)) & 255u) * (1.0f / 255.0f);
      squares += d * d;
    }
    const float error = squares * error_weight(GIVES_ARGUMENTS view, index);
    if (FIRST) {
      a.errors.v[index] = error;
      sum += error;
      if (shown != 0u) atomicAdd(a.pixels.v[shown - 1u], 1u);
    } else {
      add_fixed(a.low, shown - 1u, a.high, shown - 1u, (error - a.errors.v[index]) * a.unit);
    }
  }
  if (!FIRST) return;
  s_sum[thread] = sum;
  barrier();
  if (thread == 0u) {
    for (uint i = 1u; i < 64u; ++i) sum += s_sum[i];
    add_fixed(a.low, a.triangles, a.high, a.triangles, sum * a.unit);
  }
}
