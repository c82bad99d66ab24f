// Determines the views that show each triangle and its largest size: the number of photograph pixels that it would
// cover if its scale everywhere were that at its largest visible pixel. The texture level depends on this size. With
// perspective, a triangle is larger at its near end, which other triangles may hide.
#include "common/kernel.h"
#include "args/measure_visible.h"
#include "common/coverage.h"
#include "common/pixel_centre.h"
#include "common/tile.h"

KERNEL(64, MeasureVisibleArgs) {
  const uint tile = group_index();
  if (tile >= a.tiles) return;
  const uint view = tile_view(a.views, a.view_count, tile);
  const TilePixel pixel = tile_pixel(a.views, view, tile, gl_LocalInvocationIndex);
  if (!pixel.inside) return;
  const Hit hit = a.hits.v[pixel.index];
  if (hit.triangle == 0u) return;
  const uint triangle = hit.triangle - 1u, at = view * a.triangles + triangle;
  const vec4 p0 = a.screen.v[at].p0, p1 = a.screen.v[at].p1, p2 = a.screen.v[at].p2;
  const uint width = a.views.v[view].width, height = a.views.v[view].height;
  const float ndc = area_at(p0, p1, p2, pixel_ndc(pixel.x, pixel.y, width, height), hit.b0, hit.b1);
  const float pixels = 0.25f * ndc * float(width * height) * a.views.v[view].photograph_pixels;
  // If float cannot represent the value (NaN), use the maximum.
  const uint max_area = 1u << 30;
  const uint area = pixels < float(max_area) ? max(1u, uint(ceil(pixels))) : max_area;
  atomicMax(a.areas.v[triangle], area);
  atomicOr(a.shown.v[triangle], 1u << view);
}
