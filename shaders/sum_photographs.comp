// Sums the photographs' colours, without their exposures, on each triangle's finest lattice. A pixel contributes to
// three samples with the weights of a texture lookup.
#include "common/kernel.h"
#include "args/sum_photographs.h"
#include "common/fixed_point.h"
#include "common/block_grid.h"
#include "common/lattice.h"
#include "common/exposure.h"
#include "common/exposure_table.h"
#include "common/photograph.h"

ARGUMENTS(SumPhotographsArgs)

// Weight of a pixel in the sums, which hold up to 2^26 pixels. No more are used (engine/train/start/painting.cpp).
const float kPixelShare = 1.0f / 128.0f;

FN void add_colour(TAKES_ARGUMENTS uint sample_index, vec4 colour) {
  const uint at = sample_index * 4u;
  UNROLL for (uint c = 0u; c < 4u; ++c) add_fixed(a.low, at + c, a.high, at + c, colour[c]);
}

KERNEL_MAIN(64) {
  const uint block = group_index(), thread = gl_LocalInvocationIndex;
  if (block >= a.blocks) return;
  const uint view = block_view(a.views, a.view_count, block);
  const uvec2 corner = block_corner(a.views, view, block);
  const uint width = a.views.v[view].width, height = a.views.v[view].height;
  const uint pixel_offset = a.views.v[view].pixel_offset;
  Uints photo = a.views.v[view].photo;
  for (uint k = 0u; k < 4u; ++k) {
    const uvec2 at = block_pixel(corner, thread, k);
    if (at.x >= width || at.y >= height) continue;
    const uint pixel = at.y * width + at.x, index = pixel_offset + pixel, triangle = a.hits.v[index].triangle;
    if (triangle == 0u || triangle - 1u < a.first || triangle - 1u >= a.last) continue;
    if ((pixel + at.y + a.views.v[view].index) % a.stride != 0u) continue;
    const uint rgba = photo.v[pixel];
    if (!in_mask(rgba)) continue;
    const Texture row = a.textures.v[triangle - 1u];
    const LatticeCell cell = lattice_cell(a.hits.v[index].b0, a.hits.v[index].b1, row.level_max);
    vec3 rgb = photograph_colour(rgba);
    if (a.exposed != 0u)
      rgb = unexposed(exposure_at(a.exposure, a.views.v[view].index, at.x, at.y, width, height), rgb);
    const vec4 colour = kPixelShare * vec4(rgb, 1.0f);
    add_colour(GIVES_ARGUMENTS row.lattice_offset + cell.i0, cell.w0 * colour);
    add_colour(GIVES_ARGUMENTS row.lattice_offset + cell.i1, cell.w1 * colour);
    add_colour(GIVES_ARGUMENTS row.lattice_offset + cell.i2, cell.w2 * colour);
  }
}
