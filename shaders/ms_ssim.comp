// One scale of MS-SSIM (Wang et al. 2003): contrast and structure of every window, and luminance in the last scale.
#include "common/kernel.h"
#include "args/ms_ssim.h"
#include "common/fixed_point.h"
#include "common/ssim.h"
#include "common/block_grid.h"
#include "common/photograph.h"
#include "common/ssim_block.h"
#include "common/ssim_windows.h"

ARGUMENTS(MsSsimArgs)

CONSTANT(0, bool, FLOAT_TARGET, false);

SHARED float s_sum[64];

KERNEL_MAIN(64) {
  const uint across = (a.width + kBlock - 1u) / kBlock, down = (a.height + kBlock - 1u) / kBlock;
  const uint block = group_index(), thread = gl_LocalInvocationIndex;
  if (block >= across * down) return;
  const uvec2 corner = uvec2(block % across, block / across) * kBlock;
  for (uint channel = 0u; channel < 3u; ++channel) {
    barrier();
    load_patch(a.colour, a.target, a.float_target, FLOAT_TARGET, corner, a.width, a.height, 0u, channel, thread);
    barrier();
    blur_rows(thread);
    barrier();
    const uint column = thread & 15u, y0 = (thread >> 4) * 4u;
    const vec4 mx = blur_column(0u, column, y0), my = blur_column(1u, column, y0),
               squares = blur_column(2u, column, y0), mxy = blur_column(3u, column, y0);
    float sum = 0.0f;
    UNROLL for (uint k = 0u; k < 4u; ++k) {
      if (corner.x + column + 10u >= a.width || corner.y + y0 + k + 10u >= a.height) continue;
      sum += a.last != 0u ? ssim_window(mx[k], my[k], squares[k], mxy[k]).value
                          : contrast_structure(mx[k], my[k], squares[k], mxy[k]);
    }
    s_sum[thread] = sum;
    barrier();
    if (thread == 0u) {
      for (uint i = 1u; i < 64u; ++i) sum += s_sum[i];
      add_fixed(a.sums, 2u * channel, a.sums, 2u * channel + 1u, sum * (1.0f / IMAGE_SUM_UNIT));
    }
  }
}
