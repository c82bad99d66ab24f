// Resamples photographs between the centres of their pixels. If a step renders the soup off the pixel centres
// (ViewRecord::taps_x), the target is the photograph at the same positions.
#include "common/kernel.h"
#include "args/sample_photographs.h"
#include "common/block_grid.h"
#include "common/photograph.h"

ARGUMENTS(SamplePhotographsArgs)

FN vec4 channels_of(uint rgba) {
  return vec4(float(rgba & 255u), float((rgba >> 8) & 255u), float((rgba >> 16) & 255u), float(rgba >> 24));
}

/// Samples a photograph of width x height pixels for pixel (x, y). Weights are multiples of 1/128 and values have 8
/// bits, so every sum is exact and identical on all devices.
FN uint sampled(TAKES_ARGUMENTS uint view, int width, int height, int x, int y) {
  Uints photo = a.views.v[view].photo;
  const vec4 taps_x = a.views.v[view].taps_x, taps_y = a.views.v[view].taps_y;
  const int x0 = x + int(a.views.v[view].first_x), y0 = y + int(a.views.v[view].first_y);
  vec4 sum = vec4(0.0f);
  bool inside = true;
  UNROLL for (int j = 0; j < 4; ++j) {
    const uint row = uint(clamp(y0 + j, 0, height - 1)) * uint(width);
    UNROLL for (int i = 0; i < 4; ++i) {
      const uint rgba = photo.v[row + uint(clamp(x0 + i, 0, width - 1))];
      inside = inside && in_mask(rgba);
      sum += taps_x[i] * taps_y[j] * channels_of(rgba);
    }
  }
  const uint centre = photo.v[uint(y) * uint(width) + uint(x)], own = a.views.v[view].background;
  if (!inside) sum = channels_of(centre);  // values outside the mask must not be mixed in
  if ((own >> 24) != 0u) sum += (1.0f - coverage(sum.w)) * (channels_of(own) - channels_of(a.background));
  const vec4 value = clamp(floor(sum + 0.5f), vec4(0.0f), vec4(255.0f));
  return uint(value.x) | (uint(value.y) << 8) | (uint(value.z) << 16) | (inside ? 0xff000000u : centre & 0xff000000u);
}

KERNEL_MAIN(64) {
  const uint block = group_index(), thread = gl_LocalInvocationIndex;
  if (block >= a.blocks) return;
  const uint view = block_view(a.views, a.view_count, block);
  const uvec2 corner = block_corner(a.views, view, block);
  const uint width = a.views.v[view].width, height = a.views.v[view].height, offset = a.views.v[view].pixel_offset;
  for (uint k = 0u; k < 4u; ++k) {
    const uvec2 at = block_pixel(corner, thread, k);
    if (at.x < width && at.y < height)
      a.target.v[offset + at.y * width + at.x] =
          sampled(GIVES_ARGUMENTS view, int(width), int(height), int(at.x), int(at.y));
  }
}
