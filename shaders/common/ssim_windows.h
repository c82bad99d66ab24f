// Moments of the SSIM windows of one block and channel. Needs ssim_block.h.
SHARED float s_x[26 * 26], s_y[26 * 26];

/// Loads one channel of rendering and target into s_x and s_y: the pixels that the block's windows cover, 0 outside the
/// picture.
FN void load_patch(Floats colour, Uints target, Floats float_target, bool is_float, uvec2 corner, uint width,
                   uint height, uint pixel_offset, uint channel, uint thread) {
  for (uint first = 0u; first < kPatch; first += 2u) {
    const uint column = thread & 31u, row = first + (thread >> 5), x = corner.x + column, y = corner.y + row;
    if (column >= kPatch) continue;
    float shown = 0.0f, wanted = 0.0f;
    if (x < width && y < height)
      masked_pixel(colour, target, float_target, is_float, pixel_offset + y * width + x, channel, shown, wanted);
    s_x[row * kPatch + column] = shown;
    s_y[row * kPatch + column] = wanted;
  }
}

/// Horizontal pass of the windows over s_x and s_y. Produces rows of E[x], E[y], E[xx + yy] and E[xy] for
/// blur_column().
FN void blur_rows(uint thread) {
  for (uint first = 0u; first < kPatch; first += 64u / kRuns) {
    const uint row = first + thread / kRuns, x0 = (thread % kRuns) * kRun;
    if (row >= kPatch) continue;
    float x[10u + kRun], y[10u + kRun];
    UNROLL for (uint i = 0u; i < 10u + kRun; ++i) {
      x[i] = s_x[row * kPatch + x0 + i];
      y[i] = s_y[row * kPatch + x0 + i];
    }
    UNROLL for (uint o = 0u; o < kRun; ++o) {
      float m[4] = {0.0f, 0.0f, 0.0f, 0.0f};
      UNROLL for (int i = 0; i < 11; ++i) {
        const float tap = ssim_tap(i), p = x[o + i], q = y[o + i];
        m[0] += tap * p;
        m[1] += tap * q;
        m[2] += tap * (p * p + q * q);
        m[3] += tap * (p * q);
      }
      UNROLL for (uint k = 0u; k < 4u; ++k) s_rows[(k * kPatch + row) * kBlock + x0 + o] = m[k];
    }
  }
}
