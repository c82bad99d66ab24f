// Applies the photographs' exposures to the rendered colours. The background is not part of the scene and is not
// changed.
#include "common/kernel.h"
#include "args/expose.h"
#include "common/block_grid.h"
#include "common/exposure.h"
#include "common/exposure_table.h"

KERNEL(64, ExposeArgs) {
  const uint block = group_index(), thread = gl_LocalInvocationIndex;
  if (block >= a.blocks) return;
  const uint view = block_view(a.views, a.view_count, block);
  const uvec2 corner = block_corner(a.views, view, block);
  const uint width = a.views.v[view].width, height = a.views.v[view].height, offset = a.views.v[view].pixel_offset;
  for (uint k = 0u; k < 4u; ++k) {
    const uvec2 at = block_pixel(corner, thread, k);
    const uint index = offset + at.y * width + at.x;
    if (at.x >= width || at.y >= height || a.hits.v[index].triangle == 0u) continue;
    const Exposure exposure = exposure_at(a.exposure, a.views.v[view].index, at.x, at.y, width, height);
    const vec3 shown =
        exposed(exposure, vec3(a.colour.v[index * 3u], a.colour.v[index * 3u + 1u], a.colour.v[index * 3u + 2u]));
    UNROLL for (uint c = 0u; c < 3u; ++c) a.colour.v[index * 3u + c] = shown[c];
  }
}
