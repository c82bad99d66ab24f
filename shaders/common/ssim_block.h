// A block of 16 x 16 pixels and its surroundings for the 11-tap SSIM window. Needs block_grid.h and
// photograph.h.
const uint kPatch = 26u;  // a block and the 10 pixels by which its windows extend beyond it
// 64 threads walk over a patch in two rows of 32 at a time, so that neighbouring threads stay in one row. kRun: number
// of adjacent pixels of a row that one thread filters. A GPU thread keeps their common inputs in registers; CPU lanes
// load adjacent values at once.
#ifdef LANES_OF_A_CPU
const uint kRun = 1u;
#else
const uint kRun = 8u;
#endif
const uint kRuns = kBlock / kRun;  // runs per row

SHARED float s_rows[4 * 26 * 16];

/// Vertical pass of the window for column `x` of map `map`, rows y0 .. y0 + 3.
FN vec4 blur_column(uint map, uint x, uint y0) {
  float v[14];
  UNROLL for (uint i = 0u; i < 14u; ++i) v[i] = s_rows[(map * kPatch + y0 + i) * kBlock + x];
  vec4 sum = vec4(0.0f);
  UNROLL for (int i = 0; i < 11; ++i) sum += ssim_tap(i) * vec4(v[i], v[i + 1], v[i + 2], v[i + 3]);
  return sum;
}

/// Loads colour and target of a pixel, zero if it is masked out; returns the mask.
FN float masked_pixel(Floats colour, Uints target, Floats float_target, bool is_float, uint index, uint channel,
                      OUT(float) x, OUT(float) y) {
  float mask = 1.0f;
  x = colour.v[index * 3u + channel];
  if (is_float) {
    y = float_target.v[index * 3u + channel];
  } else {
    const uint rgba = target.v[index];
    mask = in_mask(rgba) ? 1.0f : 0.0f;
    y = float((rgba >> (8u * channel)) & 255u) * (1.0f / 255.0f) * mask;
  }
  x *= mask;
  return mask;
}
