// Lack of contrast around each pixel of the photographs: a measure of what an error there costs in SSIM (Wang et al.
// 2004). Windows of 7 x 7 pixels, restricted to the picture and its mask.
#include "common/kernel.h"
#include "args/contrast.h"
#include "common/fixed_point.h"
#include "common/block_grid.h"
#include "common/photograph.h"

const int kReach = 3;
const uint kSide = 22u;  // a block plus the reach of its windows on both sides

SHARED float s_grey[22 * 22];  // below 0: outside the mask
SHARED vec2 s_sum[64];

KERNEL(64, ContrastArgs) {
  const uint block = group_index(), thread = gl_LocalInvocationIndex;
  if (block >= a.blocks) return;
  const uint view = block_view(a.views, a.view_count, block);
  const uvec2 corner = block_corner(a.views, view, block);
  const uint width = a.views.v[view].width, height = a.views.v[view].height;
  const uint pixel_offset = a.views.v[view].pixel_offset;
  for (uint i = thread; i < kSide * kSide; i += 64u) {
    const int x = int(corner.x + i % kSide) - kReach, y = int(corner.y + i / kSide) - kReach;
    float grey = -1.0f;
    if (x >= 0 && y >= 0 && x < int(width) && y < int(height)) {
      const uint rgba = a.target.v[pixel_offset + uint(y) * width + uint(x)];
      if (in_mask(rgba))
        grey =
            (0.299f * float(rgba & 255u) + 0.587f * float((rgba >> 8) & 255u) + 0.114f * float((rgba >> 16) & 255u)) *
            (1.0f / 255.0f);
    }
    s_grey[i] = grey;
  }
  barrier();
  vec2 total = vec2(0.0f);
  for (uint k = 0u; k < 4u; ++k) {
    const uvec2 at = block_pixel(corner, thread, k);
    if (at.x >= width || at.y >= height) continue;
    const uint first = (at.y - corner.y) * kSide + at.x - corner.x, centre = first + uint(kReach) * (kSide + 1u);
    float flatness = 0.0f;
    if (s_grey[centre] >= 0.0f) {
      // Uses differences from the centre, so that rounding does not dominate the variance of flat areas.
      float count = 0.0f, sum = 0.0f, squares = 0.0f;
      for (uint j = 0u; j < 7u; ++j)
        for (uint i = 0u; i < 7u; ++i) {
          const float grey = s_grey[first + j * kSide + i], inside = grey >= 0.0f ? 1.0f : 0.0f;
          const float d = inside * (grey - s_grey[centre]);
          count += inside;
          sum += d;
          squares += d * d;
        }
      const float c2 = 9e-4f, mean = sum / count, variance = max(0.0f, squares / count - mean * mean);
      flatness = c2 / (2.0f * variance + c2);
      total += vec2(flatness, 1.0f);
    }
    a.flatness.v[pixel_offset + at.y * width + at.x] = flatness;
  }
  s_sum[thread] = total;
  barrier();
  if (thread == 0u) {
    for (uint i = 1u; i < 64u; ++i) total += s_sum[i];
    add_fixed(a.sums, view * 4u, a.sums, view * 4u + 1u, total.x * (1.0f / 1024.0f));
    atomicAdd(a.sums.v[view * 4u + 2u], uint(total.y));
  }
}
