// The next scale of MS-SSIM (Wang et al. 2003): means of 2 x 2 pixels. Edges of odd pictures repeat.
#include "common/kernel.h"
#include "args/halve.h"
#include "common/photograph.h"
#include "common/ssim.h"
#include "common/block_grid.h"
#include "common/ssim_block.h"

CONSTANT(0, bool, FLOAT_TARGET, false);

KERNEL(64, HalveArgs) {
  const uint i = thread_index(), half_width = (a.width + 1u) / 2u, half_height = (a.height + 1u) / 2u;
  if (i >= half_width * half_height) return;
  const uint x = 2u * (i % half_width), y = 2u * (i / half_width);
  UNROLL for (uint channel = 0u; channel < 3u; ++channel) {
    float colour = 0.0f, target = 0.0f;
    UNROLL for (uint k = 0u; k < 4u; ++k) {
      const uint index = min(y + k / 2u, a.height - 1u) * a.width + min(x + k % 2u, a.width - 1u);
      float shown, wanted;
      masked_pixel(a.colour, a.target, a.float_target, FLOAT_TARGET, index, channel, shown, wanted);
      colour += shown;
      target += wanted;
    }
    a.half_colour.v[3u * i + channel] = 0.25f * colour;
    a.half_target.v[3u * i + channel] = 0.25f * target;
  }
}
