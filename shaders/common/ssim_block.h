// A block of 16 x 16 pixels and its surroundings for the 11-tap SSIM window. Needs block_grid.h.
const uint kPatch = 26u;  // a block and the 10 pixels that its windows reach beyond it
// 64 threads walk a patch in two rows of 32 at a time: neighbouring threads stay in one row.
// kRun: neighbouring pixels of a row that one thread filters. A GPU's thread keeps what they share in registers; a
// CPU's lanes load what lies side by side in one go.
#ifdef LANES_OF_A_CPU
const uint kRun = 1u;
#else
const uint kRun = 8u;
#endif
const uint kRuns = kBlock / kRun;  // in a row

SHARED float s_rows[4 * 26 * 16];

/// Column `x` of map `map`, rows y0 .. y0 + 3, through the vertical half of the window.
FN vec4 blur_column(uint map, uint x, uint y0) {
  float v[14];
  UNROLL for (uint i = 0u; i < 14u; ++i) v[i] = s_rows[(map * kPatch + y0 + i) * kBlock + x];
  vec4 sum = vec4(0.0f);
  UNROLL for (int i = 0; i < 11; ++i) sum += ssim_tap(i) * vec4(v[i], v[i + 1], v[i + 2], v[i + 3]);
  return sum;
}

/// Colour and target of a pixel, zero where it is masked out; returns the mask.
FN float masked_pixel(Floats colour, Uints target, Floats float_target, bool is_float, uint index, uint channel,
                      OUT(float) x, OUT(float) y) {
  float mask = 1.0f;
  x = colour.v[index * 3u + channel];
  if (is_float) {
    y = float_target.v[index * 3u + channel];
  } else {
    const uint rgba = target.v[index];
    mask = (rgba >> 24) >= 128u ? 1.0f : 0.0f;
    y = float((rgba >> (8u * channel)) & 255u) * (1.0f / 255.0f) * mask;
  }
  x *= mask;
  return mask;
}
