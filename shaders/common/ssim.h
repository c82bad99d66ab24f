// SSIM (Wang et al. 2004) of one window and its gradient: 11-tap Gaussian, sigma 1.5, biased moments.

#define SSIM_TAPS 11

// The loss of a pixel: LOSS_L1 * L1 + LOSS_SSIM * (1 - SSIM), as published.
#define LOSS_L1 0.8f
#define LOSS_SSIM 0.1f

/// Tap i of the normalised window.
FN real ssim_tap(int i) {
  const int k = i < 5 ? 5 - i : i - 5;
  return k == 0   ? real(0.2660117248617943)
         : k == 1 ? real(0.21300553771125366)
         : k == 2 ? real(0.1093606895097)
         : k == 3 ? real(0.03600077212843082)
         : k == 4 ? real(0.007598758135239184)
                  : real(0.0010283800844791099);
}

/// SSIM of a window and its derivatives with respect to E[x], E[xx] and E[xy], where x is the rendering.
struct SsimWindow {
  real value, d_x, d_xx, d_xy;
};

/// x, y: E[x], E[y]; squares: E[xx + yy], since the two are never needed separately; xy: E[xy].
FN SsimWindow ssim_window(real x, real y, real squares, real xy) {
  const real c1 = real(1e-4), c2 = real(9e-4);
  const real a1 = real(2) * x * y + c1, a2 = real(2) * (xy - x * y) + c2;
  const real b1 = x * x + y * y + c1, b2 = squares - x * x - y * y + c2;
  const real inv = real(1) / (b1 * b2);
  SsimWindow s;
  s.value = a1 * a2 * inv;
  s.d_xy = real(2) * a1 * inv;
  s.d_xx = -s.value / b2;
  s.d_x = real(2) * y * (a2 - a1) * inv - s.value * (real(2) * x / b1 - real(2) * x / b2);
  return s;
}

/// The factors of contrast and structure alone, as MS-SSIM (Wang et al. 2003) takes them of the finer scales.
FN real contrast_structure(real x, real y, real squares, real xy) {
  const real c2 = real(9e-4);
  return (real(2) * (xy - x * y) + c2) / (squares - x * x - y * y + c2);
}
