// PSNR, SSIM (Wang et al. 2004), MAE and coverage of rendered views, as sums that the host divides
// (engine/train/quality/image_sums.h).
#include "common/kernel.h"
#include "args/image_metrics.h"
#include "common/fixed_point.h"
#include "common/ssim.h"
#include "common/block_grid.h"
#include "common/photograph.h"
#include "common/ssim_block.h"
#include "common/ssim_windows.h"

ARGUMENTS(ImageMetricsArgs)

// 0: without SSIM, which takes most of the time; 1: SSIM of all windows; 2: of windows whose centre is in the mask.
CONSTANT(0, uint, WINDOWS, 0u);

SHARED vec3 s_sum[64];     // absolute errors, squared errors, SSIM
SHARED uvec4 s_count[64];  // pixels, uncovered pixels, windows

/// Whether the window that begins at a pixel counts. It is complete.
FN bool counts(TAKES_ARGUMENTS uvec2 first, uint width, uint pixel_offset) {
  if (WINDOWS < 2u) return true;
  return in_mask(a.target.v[pixel_offset + (first.y + 5u) * width + first.x + 5u]);
}

/// Sum of the SSIM of this thread's windows over the channels. windows: their number is added.
FN float ssim_of_block(TAKES_ARGUMENTS uvec2 corner, uint width, uint height, uint pixel_offset, uint thread,
                       INOUT(uint) windows) {
  float total = 0.0f;
  for (uint channel = 0u; channel < 3u; ++channel) {
    barrier();
    load_patch(a.colour, a.target, a.float_target, false, corner, width, height, pixel_offset, channel, thread);
    barrier();
    blur_rows(thread);
    barrier();
    const uint column = thread & 15u, y0 = (thread >> 4) * 4u;
    const vec4 mx = blur_column(0u, column, y0), my = blur_column(1u, column, y0);
    const vec4 squares = blur_column(2u, column, y0), mxy = blur_column(3u, column, y0);
    UNROLL for (uint k = 0u; k < 4u; ++k) {
      const uvec2 first = corner + uvec2(column, y0 + k);
      if (first.x + 10u >= width || first.y + 10u >= height) continue;
      if (!counts(GIVES_ARGUMENTS first, width, pixel_offset)) continue;
      total += ssim_window(mx[k], my[k], squares[k], mxy[k]).value;
      if (channel == 0u) ++windows;
    }
  }
  return total;
}

/// Whether the photograph shows the background colour, so that no triangle is needed.
FN bool is_background(TAKES_ARGUMENTS uint view, uint rgba) {
  const float same = 8.0f;
  const vec3 background =
      background_of(a.views.v[view].background, vec3(a.background_r, a.background_g, a.background_b));
  const vec3 shown = vec3(float(rgba & 255u), float((rgba >> 8) & 255u), float((rgba >> 16) & 255u));
  const vec3 d = abs(shown - 255.0f * background);
  return max(d.x, max(d.y, d.z)) <= same;
}

KERNEL_MAIN(64) {
  const uint block = group_index(), thread = gl_LocalInvocationIndex;
  if (block >= a.blocks) return;
  const uint view = block_view(a.views, a.view_count, block);
  const uvec2 corner = block_corner(a.views, view, block);
  const uint width = a.views.v[view].width, height = a.views.v[view].height;
  const uint pixel_offset = a.views.v[view].pixel_offset;
  vec3 sum = vec3(0.0f);
  uvec4 count = uvec4(0u);
  for (uint k = 0u; k < 4u; ++k) {
    const uvec2 at = block_pixel(corner, thread, k);
    if (at.x >= width || at.y >= height) continue;
    const uint index = pixel_offset + at.y * width + at.x, rgba = a.target.v[index];
    if (!in_mask(rgba)) continue;
    UNROLL for (uint c = 0u; c < 3u; ++c) {
      const float error = a.colour.v[index * 3u + c] - float((rgba >> (8u * c)) & 255u) * (1.0f / 255.0f);
      sum.x += abs(error);
      sum.y += error * error;
    }
    count.x += 1u;
    if (a.hits.v[index].triangle == 0u && !is_background(GIVES_ARGUMENTS view, rgba)) count.y += 1u;
  }
  uint windows = 0u;
  if (WINDOWS != 0u) sum.z = ssim_of_block(GIVES_ARGUMENTS corner, width, height, pixel_offset, thread, windows);
  count.z = windows;
  s_sum[thread] = sum;
  s_count[thread] = count;
  barrier();
  if (thread == 0u) {
    for (uint i = 1u; i < 64u; ++i) {
      sum += s_sum[i];
      count += s_count[i];
    }
    sum *= 1.0f / IMAGE_SUM_UNIT;
    const uint at = view * 12u;
    add_fixed(a.sums, at, a.sums, at + 1u, sum.x);
    add_fixed(a.sums, at + 2u, a.sums, at + 3u, sum.y);
    add_fixed(a.sums, at + 4u, a.sums, at + 5u, sum.z);
    atomicAdd(a.sums.v[at + 6u], count.x);
    atomicAdd(a.sums.v[at + 7u], count.y);
    atomicAdd(a.sums.v[at + 8u], count.z);
  }
}
