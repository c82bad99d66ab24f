// SSIM of every window of a view and its derivatives with respect to the window's moments (common/ssim.h).
#include "common/kernel.h"
#include "args/ssim.h"
#include "common/fixed_point.h"
#include "common/ssim.h"
#include "common/block_grid.h"
#include "common/photograph.h"
#include "common/ssim_block.h"
#include "common/ssim_windows.h"

ARGUMENTS(SsimArgs)

CONSTANT(0, bool, FLOAT_TARGET, false);

SHARED float s_sum[64];

/// Adds to the batch's mean SSIM.
FN void add_ssim(TAKES_ARGUMENTS float sum) {
  const uint at = a.state.v[0].slot * 8u;
  add_fixed(a.statistics, at + 2u, a.statistics, at + 3u, sum * a.state.v[0].window_weight);
}

FN void ssim_of_block(TAKES_ARGUMENTS uint block, uint thread) {
  const uint view = block_view(a.views, a.view_count, block);
  const uvec2 corner = block_corner(a.views, view, block);
  const uint width = a.views.v[view].width, height = a.views.v[view].height;
  const uint pixel_offset = a.views.v[view].pixel_offset;

  float total = 0.0f;
  for (uint channel = 0u; channel < 3u; ++channel) {
    barrier();
    load_patch(a.colour, a.target, a.float_target, FLOAT_TARGET, corner, width, height, pixel_offset, channel, thread);
    barrier();
    blur_rows(thread);
    barrier();
    const uint column = thread & 15u, y0 = (thread >> 4) * 4u;
    const vec4 mx = blur_column(0u, column, y0), my = blur_column(1u, column, y0),
               squares = blur_column(2u, column, y0), mxy = blur_column(3u, column, y0);
    UNROLL for (uint k = 0u; k < 4u; ++k) {
      const uint x = corner.x + column, y = corner.y + y0 + k;
      if (x >= width || y >= height) continue;
      SsimWindow s;
      s.value = s.d_x = s.d_xx = s.d_xy = 0.0f;
      // A window is identified by its first pixel. Windows that extend beyond the image do not count.
      if (x + 10u < width && y + 10u < height) s = ssim_window(mx[k], my[k], squares[k], mxy[k]);
      total += s.value;
      const uint at = pixel_offset + y * width + x;
      a.partial.v[(channel * 3u) * a.pixels + at] = s.d_x;
      a.partial.v[(channel * 3u + 1u) * a.pixels + at] = s.d_xx;
      a.partial.v[(channel * 3u + 2u) * a.pixels + at] = s.d_xy;
    }
  }

  s_sum[thread] = total;
  barrier();
  if (thread == 0u) {
    float sum = 0.0f;
    for (uint i = 0u; i < 64u; ++i) sum += s_sum[i];
    add_ssim(GIVES_ARGUMENTS sum);
  }
}

SHARED uint s_differs;

/// Returns the first of this workgroup's blocks, starting at `block`, with a window in which rendering and target
/// differ, or a.blocks. In skipped blocks SSIM is 1 and its gradient zero. Uniform in the workgroup. A separate loop
/// for the reason given in shade_backward.comp.
FN uint next_different(TAKES_ARGUMENTS uint block, uint thread) {
  for (; block < a.blocks; block += a.groups) {
    barrier();
    if (thread == 0u) s_differs = 0u;
    barrier();
    const uint view = block_view(a.views, a.view_count, block);
    const uvec2 corner = block_corner(a.views, view, block);
    const uint width = a.views.v[view].width, height = a.views.v[view].height,
               pixel_offset = a.views.v[view].pixel_offset;
    for (uint first = 0u; first < kPatch; first += 2u) {
      const uint column = thread & 31u, row = first + (thread >> 5), x = corner.x + column, y = corner.y + row;
      if (column < kPatch && x < width && y < height) {
        bool differs = false;
        UNROLL for (uint channel = 0u; channel < 3u; ++channel) {
          float colour, target;
          masked_pixel(a.colour, a.target, a.float_target, FLOAT_TARGET, pixel_offset + y * width + x, channel, colour,
                       target);
          differs = differs || colour != target;
        }
        if (differs) s_differs = 1u;
      }
      barrier();
      if (s_differs != 0u) break;
      barrier();
    }
    if (thread == 0u) a.same.v[block] = 1u - s_differs;
    if (s_differs != 0u) break;
    UNROLL for (uint k = 0u; k < 4u; ++k) {
      const uint x = corner.x + (thread & 15u), y = corner.y + (thread >> 4) * 4u + k;
      if (x >= width || y >= height) continue;
      UNROLL for (uint map = 0u; map < 9u; ++map) a.partial.v[map * a.pixels + pixel_offset + y * width + x] = 0.0f;
    }
    if (thread == 0u && corner.x + 10u < width && corner.y + 10u < height)
      add_ssim(GIVES_ARGUMENTS 3.0f *
               float(min(kBlock, width - 10u - corner.x) * min(kBlock, height - 10u - corner.y)));
  }
  return block;
}

KERNEL_MAIN(64) {
  const uint group = group_index(), thread = gl_LocalInvocationIndex;
  if (group >= a.groups) return;
  uint block = next_different(GIVES_ARGUMENTS group, thread);
  if (block < a.blocks) do {
      ssim_of_block(GIVES_ARGUMENTS block, thread);
      block = next_different(GIVES_ARGUMENTS block + a.groups, thread);
    } while (block < a.blocks);
}
