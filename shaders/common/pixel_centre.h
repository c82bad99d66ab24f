// Pixel positions.

/// Returns the NDC of the centre of pixel (x, y).
FN vec2 pixel_ndc(uint x, uint y, uint width, uint height) {
  return vec2(real(-1) + real(2) * (real(x) + real(0.5)) / real(width),
              real(-1) + real(2) * (real(y) + real(0.5)) / real(height));
}
