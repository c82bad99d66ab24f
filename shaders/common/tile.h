// Pixels of a workgroup of 64 threads: a tile of 8 x 8 pixels of one view of the batch. Needs views, tiles and
// view_count in `a`.
const uint kTile = 8u;

/// Returns the view of a tile. Uniform in the workgroup.
FN uint tile_view(Views views, uint view_count, uint tile) {
  uint view = 0u;
  while (view + 1u < view_count && tile >= views.v[view + 1u].tile_offset) ++view;
  return view;
}

struct TilePixel {
  uint x, y;
  uint index;   // in the batch buffers
  bool inside;  // tiles at the border extend beyond the image
};

FN TilePixel tile_pixel(Views views, uint view, uint tile, uint thread) {
  const uint local = tile - views.v[view].tile_offset;
  const uint tiles_x = views.v[view].tiles_x;
  TilePixel p;
  p.x = (local % tiles_x) * kTile + (thread % kTile);
  p.y = (local / tiles_x) * kTile + (thread / kTile);
  const uint width = views.v[view].width;
  p.inside = p.x < width && p.y < views.v[view].height;
  p.index = views.v[view].pixel_offset + p.y * width + p.x;
  return p;
}

/// NDC of a tile's centre: the origin of its triangles' edge functions.
FN vec2 tile_origin(Views views, uint view, uint tile) {
  const uint local = tile - views.v[view].tile_offset;
  const uint tiles_x = views.v[view].tiles_x;
  const vec2 corner = vec2((local % tiles_x) * kTile, (local / tiles_x) * kTile) + 0.5f * float(kTile);
  return 2.0f * corner / vec2(views.v[view].width, views.v[view].height) - 1.0f;
}
