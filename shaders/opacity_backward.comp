// Likelihood-ratio gradient of the opacities (DiffSoup, section 4.2): attributes the sampled L1 error to every fragment
// that the pixel saw through and to the visible one.
#include "common/kernel.h"
#include "args/opacity_backward.h"
#include "common/coverage.h"
#include "common/pixel_centre.h"
#include "common/fixed_point.h"
#include "common/lattice.h"
#include "common/tile.h"
#include "common/staging.h"

ARGUMENTS(OpacityBackwardArgs)

CONSTANT(0, bool, BASELINE, false);  // use the difference to the errors of the surrounding pixels

/// Returns the mean error of the neighbouring pixels. Their thresholds are independent of this pixel's, so subtracting
/// it does not change the gradient's mean but lowers its variance (Williams 1992, reinforcement baselines).
FN float error_around(TAKES_ARGUMENTS TilePixel pixel, uint view) {
  const int width = int(a.views.v[view].width), height = int(a.views.v[view].height);
  float sum = 0.0f, count = 0.0f;
  for (int dy = -1; dy <= 1; ++dy)
    for (int dx = -1; dx <= 1; ++dx) {
      const int x = int(pixel.x) + dx, y = int(pixel.y) + dy;
      if ((dx == 0 && dy == 0) || x < 0 || y < 0 || x >= width || y >= height) continue;
      const float error = a.gradient.v[(a.views.v[view].pixel_offset + uint(y * width + x)) * 4u + 3u];
      if (error < 0.0f) continue;
      sum += error;
      count += 1.0f;
    }
  return count > 0.0f ? sum / count : 0.0f;
}

KERNEL_MAIN(64) {
  if (group_index() >= a.tiles) return;
  const uint tile = a.tile_first + group_index(), thread = gl_LocalInvocationIndex;
  const uint view = tile_view(a.views, a.view_count, tile);
  const TilePixel pixel = tile_pixel(a.views, view, tile, thread);
  const vec2 origin = tile_origin(a.views, view, tile);
  const vec2 d = pixel_ndc(pixel.x, pixel.y, a.views.v[view].width, a.views.v[view].height) - origin;
  const uint first = min(a.offsets.v[tile], a.capacity), last = min(a.offsets.v[tile + 1u], a.capacity);

  uint winner = 0u;
  float depth_limit = 1.0f, weight = 0.0f;
  if (pixel.inside) {
    winner = a.hits.v[pixel.index].triangle;
    if (winner != 0u) depth_limit = a.hits.v[pixel.index].depth;
    const float error = a.gradient.v[pixel.index * 4u + 3u];
    if (error >= 0.0f)
      weight = (BASELINE ? error - error_around(GIVES_ARGUMENTS pixel, view) : error) * a.state.v[0].pixel_weight;
  }

  for (uint base = first; base < last; base += 64u) {
    barrier();
    if (base + thread < last)
      stage_triangle(thread, a.lists.v[base + thread], a.screen, view * a.triangles, a.textures, origin);
    barrier();
    const uint count = min(64u, last - base);
    for (uint first_slot = 0u; first_slot < count; first_slot += 32u) {
      for (uint bits = weight != 0.0f ? covering(first_slot, count, d, depth_limit, winner != 0u ? winner : 0xffffffffu)
                                      : 0u;
           bits != 0u; bits &= bits - 1u) {
        const uint k = first_slot + uint(findLSB(bits));
        const float e0 = at_offset(vec3(s_e0[k]), d), e1 = at_offset(vec3(s_e1[k]), d),
                    e2 = at_offset(vec3(s_e2[k]), d);
        const uvec4 row = s_texture[k];
        const float sum = e0 + e1 + e2;
        const LatticeCell cell = lattice_cell(e0 / sum, e1 / sum, row.y);
        const float alpha = opacity_at(a.opacity, row, cell);
        const float g = row.z + 1u == winner ? weight / max(alpha, 1e-5f) : -weight / max(1.0f - alpha, 1e-5f);
        const uint i0 = row.x + cell.i0, i1 = row.x + cell.i1, i2 = row.x + cell.i2;
        MARK(a.touched.v[row.z]);
        add_fixed(a.gradient_low, i0, a.gradient_high, i0, cell.w0 * g);
        add_fixed(a.gradient_low, i1, a.gradient_high, i1, cell.w1 * g);
        add_fixed(a.gradient_low, i2, a.gradient_high, i2, cell.w2 * g);
      }
    }
  }
}
