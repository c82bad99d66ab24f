// Finds the triangles that may cover each tile: counts them, or writes them into the tiles' lists with FILL.
#include "common/kernel.h"
#include "args/bin.h"
#include "common/coverage.h"

CONSTANT(0, bool, FILL, false);

const uint kTile = 8u;

KERNEL(64, BinArgs) {
  // A group belongs to one view.
  const uint groups = (a.triangles + 63u) / 64u;
  const uint view = group_index() / groups, triangle = group_index() % groups * 64u + gl_LocalInvocationIndex;
  if (view >= a.view_count || triangle >= a.triangles) return;
  const uint i = view * a.triangles + triangle;
  const uint low = a.screen.v[i].box_min, high = a.screen.v[i].box_max;
  if (low == 0xffffffffu) return;
  const vec2 size = vec2(a.views.v[view].width, a.views.v[view].height);
  const uint tiles_x = a.views.v[view].tiles_x, first_tile = a.views.v[view].tile_offset;
  const uvec2 t0 = uvec2(low & 0xffffu, low >> 16) / kTile, t1 = uvec2(high & 0xffffu, high >> 16) / kTile;

  // Counting and filling are separate pipelines and must agree exactly.
  PRECISE const vec2 step = 2.0f * float(kTile) / size;  // NDC per tile
  PRECISE const vec2 origin = (vec2(t0) + 0.5f) * step - 1.0f;
  const TriangleSetup setup = triangle_setup(a.screen.v[i].p0, a.screen.v[i].p1, a.screen.v[i].p2, origin);
  if (!setup.valid) return;
  // A tile is outside if an edge function is negative everywhere in it. Half a tile's width exceeds the distance to the
  // outer pixel centres by half a pixel, which covers rounding.
  const vec2 half_tile = 0.5f * step;
  PRECISE const vec3 reach = vec3(abs(setup.e0.y) * half_tile.x + abs(setup.e0.z) * half_tile.y,
                                  abs(setup.e1.y) * half_tile.x + abs(setup.e1.z) * half_tile.y,
                                  abs(setup.e2.y) * half_tile.x + abs(setup.e2.z) * half_tile.y);
  // The rows of this view in which the band has tiles.
  const uint tile_end = a.tile_first + a.tiles;
  if (tile_end <= first_tile || a.tile_first >= first_tile + tiles_x * a.views.v[view].tiles_y) return;
  const uint y0 = a.tile_first > first_tile ? (a.tile_first - first_tile) / tiles_x : 0u;
  const uint y1 = (tile_end - 1u - first_tile) / tiles_x;
  for (uint y = max(t0.y, y0); y <= min(t1.y, y1); ++y)
    for (uint x = t0.x; x <= t1.x; ++x) {
      const uint tile = first_tile + y * tiles_x + x;
      if (tile < a.tile_first || tile >= tile_end) continue;
      PRECISE const vec2 d = vec2(x - t0.x, y - t0.y) * step;
      if (at_offset(setup.e0, d) + reach.x < 0.0f || at_offset(setup.e1, d) + reach.y < 0.0f ||
          at_offset(setup.e2, d) + reach.z < 0.0f)
        continue;
      const uint count = atomicAdd(a.counts.v[tile], FILL ? 0xffffffffu : 1u);
      if (FILL) {
        const uint at = a.offsets.v[tile] + count - 1u;
        if (at < a.capacity) a.lists.v[at] = triangle;
      }
    }
}
