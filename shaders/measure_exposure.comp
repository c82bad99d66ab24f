// Sums over the pixels of every view from which the exposure of its photograph is fitted. Skips pixels without a
// triangle, masked-out pixels and clipped values of the photograph.
#include "common/kernel.h"
#include "args/measure_exposure.h"
#include "common/block_grid.h"
#include "common/exposure.h"
#include "common/exposure_table.h"
#include "common/fixed_point.h"
#include "common/photograph.h"

ARGUMENTS(MeasureExposureArgs)

const uint kSums = 4u * EXPOSURE_SUMS;  // vectors: the sums of the corners of a square
SHARED vec4 s_sums[64 * kSums];

/// Adds what the pixels of a block say that lie in one square of the grid of gains.
FN void measure_square(TAKES_ARGUMENTS uint view, uvec2 corner, uint square, uint thread) {
  const uint width = a.views.v[view].width, height = a.views.v[view].height, offset = a.views.v[view].pixel_offset;
  const ExposureSquare so_far = load_square(a.exposure, a.views.v[view].index, square);
  vec4 sums[kSums];
  UNROLL for (uint i = 0u; i < kSums; ++i) sums[i] = vec4(0.0f);
  for (uint k = 0u; k < 4u; ++k) {
    const uvec2 at = block_pixel(corner, thread, k);
    const uint index = offset + at.y * width + at.x;
    if (at.x >= width || at.y >= height || a.hits.v[index].triangle == 0u) continue;
    const vec2 centre = picture_point(at.x, at.y, width, height);
    if (exposure_square(centre.x, centre.y) != square) continue;
    const uint rgba = a.target.v[index];
    if (!in_mask(rgba)) continue;
    const vec3 colour = vec3(a.colour.v[index * 3u], a.colour.v[index * 3u + 1u], a.colour.v[index * 3u + 2u]);
    const vec4 weights = exposure_weights(centre.x, centre.y, square);
    vec4 pixel[EXPOSURE_SUMS];
    UNROLL for (uint i = 0u; i < EXPOSURE_SUMS; ++i) pixel[i] = vec4(0.0f);
    add_to_exposure(colour, photograph_colour(rgba), exposure_in(so_far, weights), pixel);
    UNROLL for (uint q = 0u; q < 4u; ++q) UNROLL for (uint i = 0u; i < EXPOSURE_SUMS; ++i)
        sums[q * EXPOSURE_SUMS + i] += weights[q] * pixel[i];
  }
  UNROLL for (uint i = 0u; i < kSums; ++i) s_sums[thread * kSums + i] = sums[i];
  barrier();
  if (thread < 4u * kSums) {
    float sum = 0.0f;
    for (uint i = 0u; i < 64u; ++i) sum += s_sums[i * kSums + thread / 4u][thread % 4u];
    const uint q = thread / (4u * EXPOSURE_SUMS), place = exposure_corner(square, q);
    const uint at = (view * EXPOSURE_PLACES + place) * 4u * EXPOSURE_SUMS + thread % (4u * EXPOSURE_SUMS);
    add_fixed(a.sums_low, at, a.sums_high, at, sum * (1.0f / 256.0f));
  }
  barrier();
}

FN void measure_block(TAKES_ARGUMENTS uint block, uint thread) {
  const uint view = block_view(a.views, a.view_count, block);
  const uvec2 corner = block_corner(a.views, view, block);
  const uint width = a.views.v[view].width, height = a.views.v[view].height;
  const vec2 from = picture_point(corner.x, corner.y, width, height),
             to = picture_point(min(corner.x + 15u, width - 1u), min(corner.y + 15u, height - 1u), width, height);
  const uint first = exposure_square(from.x, from.y), last = exposure_square(to.x, to.y);
  for (uint row = first / EXPOSURE_SIDE; row <= last / EXPOSURE_SIDE; ++row)
    for (uint column = first % EXPOSURE_SIDE; column <= last % EXPOSURE_SIDE; ++column)
      measure_square(GIVES_ARGUMENTS view, corner, row * EXPOSURE_SIDE + column, thread);
}

KERNEL_MAIN(64) {
  const uint group = group_index();
  if (group >= a.groups) return;
  for (uint block = group; block < a.blocks; block += a.groups)
    measure_block(GIVES_ARGUMENTS block, gl_LocalInvocationIndex);
}
