// Computes dL/dC of L = 0.8 mean|C - target| + 0.1 (1 - SSIM), the L1 error of every pixel for the opacity gradient,
// and the sums for the statistics. Below a threshold, the gradient is proportional to the error (Huber 1964), because
// the sign of a small error is mostly noise.
#include "common/kernel.h"
#include "args/loss_gradient.h"
#include "common/fixed_point.h"
#include "common/ssim.h"
#include "common/block_grid.h"
#include "common/photograph.h"
#include "common/ssim_block.h"

ARGUMENTS(LossGradientArgs)

CONSTANT(0, bool, FLOAT_TARGET, false);

SHARED float s_map[3 * 26 * 26];
SHARED vec2 s_sum[64];

FN void gradient_of_block(TAKES_ARGUMENTS uint block, uint thread) {
  const uint view = block_view(a.views, a.view_count, block);
  const uvec2 corner = block_corner(a.views, view, block);
  const uint width = a.views.v[view].width, height = a.views.v[view].height;
  const uint pixel_offset = a.views.v[view].pixel_offset;
  const float l1_weight = LOSS_L1 * a.state.v[0].pixel_weight;
  const float ssim_weight = -LOSS_SSIM * a.state.v[0].window_weight;
  const uint column = thread & 15u, y0 = (thread >> 4) * 4u;

  vec4 l1 = vec4(0.0f), squares = vec4(0.0f), seen = vec4(0.0f);
  vec4 gradient[4] = {vec4(0.0f), vec4(0.0f), vec4(0.0f), vec4(0.0f)};  // gradients of the thread's pixels
  for (uint channel = 0u; channel < 3u; ++channel) {
    barrier();
    for (uint first = 0u; first < kPatch; first += 2u) {
      // The windows that contain a pixel start at most 10 pixels before it.
      const uint column = thread & 31u, row = first + (thread >> 5);
      const int x = int(corner.x + column) - 10, y = int(corner.y + row) - 10;
      if (column >= kPatch) continue;
      const bool inside = x >= 0 && y >= 0 && x < int(width) && y < int(height);
      const uint at = pixel_offset + uint(y) * width + uint(x);
      UNROLL for (uint k = 0u; k < 3u; ++k) s_map[(k * kPatch + row) * kPatch + column] =
          inside ? a.partial.v[(channel * 3u + k) * a.pixels + at] : 0.0f;
    }
    barrier();
    for (uint first = 0u; first < kPatch; first += 64u / kRuns) {
      const uint row = first + thread / kRuns, x0 = (thread % kRuns) * kRun;
      if (row >= kPatch) continue;
      UNROLL for (uint k = 0u; k < 3u; ++k) {
        float v[10u + kRun];
        UNROLL for (uint i = 0u; i < 10u + kRun; ++i) v[i] = s_map[(k * kPatch + row) * kPatch + x0 + i];
        UNROLL for (uint o = 0u; o < kRun; ++o) {
          float sum = 0.0f;
          UNROLL for (int i = 0; i < 11; ++i) sum += ssim_tap(i) * v[o + i];
          s_rows[(k * kPatch + row) * kBlock + x0 + o] = sum;
        }
      }
    }
    barrier();
    const vec4 d_x = blur_column(0u, column, y0), d_xx = blur_column(1u, column, y0),
               d_xy = blur_column(2u, column, y0);
    UNROLL for (uint k = 0u; k < 4u; ++k) {
      const uint x = corner.x + column, y = corner.y + y0 + k;
      if (x >= width || y >= height) continue;
      const uint at = pixel_offset + y * width + x;
      float colour, target;
      const float mask = masked_pixel(a.colour, a.target, a.float_target, FLOAT_TARGET, at, channel, colour, target);
      const float error = colour - target;
      const float d_colour = mask * (l1_weight * clamp(error * a.state.v[0].error_slope, -1.0f, 1.0f) +
                                     ssim_weight * (d_x[k] + 2.0f * colour * d_xx[k] + target * d_xy[k]));
      if (channel == 0u)
        gradient[k].x = d_colour;
      else if (channel == 1u)
        gradient[k].y = d_colour;
      else
        gradient[k].z = d_colour;
      seen[k] = mask;
      l1[k] += abs(error);
      squares[k] += error * error;
    }
  }

  float l1_sum = 0.0f, square_sum = 0.0f;
  UNROLL for (uint k = 0u; k < 4u; ++k) {
    const uint x = corner.x + column, y = corner.y + y0 + k;
    if (x >= width || y >= height) continue;
    gradient[k].w = seen[k] > 0.0f ? l1[k] : -1.0f;
    a.gradient.v[pixel_offset + y * width + x] = gradient[k];
    l1_sum += l1[k];
    square_sum += squares[k];
  }
  s_sum[thread] = vec2(l1_sum, square_sum);
  barrier();
  if (thread == 0u) {
    vec2 sum = vec2(0.0f);
    for (uint i = 0u; i < 64u; ++i) sum += s_sum[i];
    sum *= a.state.v[0].pixel_weight;
    const uint at = a.state.v[0].slot * 8u;
    add_fixed(a.statistics, at, a.statistics, at + 1u, sum.x);
    add_fixed(a.statistics, at + 4u, a.statistics, at + 5u, sum.y);
  }
}

/// Whether rendering and target are equal in all windows over a block's pixels: the windows of the block and of the
/// blocks before it.
FN bool is_same(TAKES_ARGUMENTS uint view, uint block) {
  const uint blocks_x = (a.views.v[view].width + kBlock - 1u) / kBlock, local = block - a.views.v[view].block_offset;
  const uint left = local % blocks_x > 0u ? 1u : 0u, up = local >= blocks_x ? blocks_x : 0u;
  return (a.same.v[block] & a.same.v[block - left] & a.same.v[block - up] & a.same.v[block - up - left]) != 0u;
}

/// Returns the first of this workgroup's blocks, starting at `block`, that has a gradient, or a.blocks. Writes zero
/// gradients for the blocks it skips.
FN uint next_different(TAKES_ARGUMENTS uint block, uint thread) {
  for (; block < a.blocks; block += a.groups) {
    const uint view = block_view(a.views, a.view_count, block);
    if (!is_same(GIVES_ARGUMENTS view, block)) break;
    const uvec2 corner = block_corner(a.views, view, block);
    const uint width = a.views.v[view].width, height = a.views.v[view].height;
    UNROLL for (uint k = 0u; k < 4u; ++k) {
      const uint x = corner.x + (thread & 15u), y = corner.y + (thread >> 4) * 4u + k;
      if (x >= width || y >= height) continue;
      const uint at = a.views.v[view].pixel_offset + y * width + x;
      float colour, target;
      const float mask = masked_pixel(a.colour, a.target, a.float_target, FLOAT_TARGET, at, 0u, colour, target);
      a.gradient.v[at] = vec4(0.0f, 0.0f, 0.0f, mask > 0.0f ? 0.0f : -1.0f);
    }
  }
  return block;
}

KERNEL_MAIN(64) {
  const uint group = group_index(), thread = gl_LocalInvocationIndex;
  if (group >= a.groups) return;
  uint block = next_different(GIVES_ARGUMENTS group, thread);
  if (block < a.blocks) do {
      gradient_of_block(GIVES_ARGUMENTS block, thread);
      barrier();  // before shared memory is reused
      block = next_different(GIVES_ARGUMENTS block + a.groups, thread);
    } while (block < a.blocks);
}
