// Exposure: what a photograph's brightness and white balance make of the scene's colours. It multiplies the odds
// c / (1 - c) of each channel, so that dark colours have a gain and white stays white, like the tone curves of cameras
// (Reinhard et al. 2002). Exposures form a group: gains, as logarithms, add up. They are fitted whenever a step renders
// the photograph (docs/method.md, "Exposure"): Gauss-Newton on weighted squares (Holland and Welsch 1977) with ridge
// regularisation towards the start's exposure (Hoerl and Kennard 1970).

struct Exposure {
  vec3 gain;      // logarithms of the factors of the odds; 0: colours stay
  real variance;  // of a fitted gain, mean over the channels
};

// Gains vary over a picture, because lenses let less light into the corners, and because who takes it throws a shadow:
// bilinearly between 5 x 5 places, row by row, from the picture's top left corner to its bottom right one (bilateral
// grids without their third axis: Chen, Paris, Durand 2007; Wang et al. 2024).
#define EXPOSURE_SIDE 5u
#define EXPOSURE_PLACES 25u

/// A gain is at most this, either way: beyond, colours are black or white.
#define EXPOSURE_MOST 5.0f

/// The first corner of the square of places around a point of the picture, 0..1 each.
FN uint exposure_square(real x, real y) {
  const real squares = real(EXPOSURE_SIDE - 1u), last = real(EXPOSURE_SIDE - 2u);
  return uint(clamp(squares * y, real(0), last)) * EXPOSURE_SIDE + uint(clamp(squares * x, real(0), last));
}
/// The place of a square's corner k: right and left, above and below.
FN uint exposure_corner(uint first, uint k) { return first + (k & 1u) + (k >> 1) * EXPOSURE_SIDE; }
/// Weights of the corners of a square for a point; for one outside, those of the nearest point of the square.
FN vec4 exposure_weights(real x, real y, uint first) {
  const real u = clamp(real(EXPOSURE_SIDE - 1u) * x - real(first % EXPOSURE_SIDE), real(0), real(1)),
             v = clamp(real(EXPOSURE_SIDE - 1u) * y - real(first / EXPOSURE_SIDE), real(0), real(1));
  return vec4((real(1) - u) * (real(1) - v), u * (real(1) - v), (real(1) - u) * v, u * v);
}

/// Colours c and results are 0..1.
FN vec3 exposed(IN(Exposure) m, vec3 c) {
  const vec3 factor = vec3(exp(m.gain.x), exp(m.gain.y), exp(m.gain.z));
  return factor * c / (vec3(real(1)) + (factor - vec3(real(1))) * c);
}

/// Returns dL/dc of the colour c from d = dL/d(exposed colour).
FN vec3 exposed_backward(IN(Exposure) m, vec3 c, vec3 d) {
  const vec3 factor = vec3(exp(m.gain.x), exp(m.gain.y), exp(m.gain.z));
  const vec3 q = vec3(real(1)) + (factor - vec3(real(1))) * c;
  return d * factor / (q * q);
}

/// The colour that the exposure turns into c.
FN vec3 unexposed(IN(Exposure) m, vec3 c) {
  Exposure back;
  back.gain = -m.gain;
  back.variance = m.variance;
  return exposed(back, c);
}

/// Shrinkage factor of the exposures (James and Stein 1961): 0 if they spread no more than their uncertainty. spread:
/// variance of the gains over the photographs. noise: mean of the gains' own variances.
FN real exposure_share(real spread, real noise) { return spread > noise ? real(1) - noise / spread : real(0); }

// Sums over pixels that a fit needs: w (j j, 1) and w (j e, |e|^2 / 3), with products per channel. e: exposed colour
// minus photograph; j: derivative of the exposed colour by the gain; w: weight of the pixel.
#define EXPOSURE_SUMS 2

/// Adds a pixel. Where a rendering is wrong (holes, edges, transient objects) it says nothing about the exposure.
/// Weights 1 / (|e| + slack) make the fit nearly an L1 fit, like the loss. so_far: exposure of the photograph.
FN void add_to_exposure(vec3 c, vec3 photograph, IN(Exposure) so_far, INOUT_ARRAY_OF(vec4, sums, EXPOSURE_SUMS)) {
  // For the brightest and darkest values of a photograph only a bound is known.
  if (min(photograph.x, min(photograph.y, photograph.z)) <= real(0) ||
      max(photograph.x, max(photograph.y, photograph.z)) >= real(1))
    return;
  const real slack = real(0.02);
  const vec3 shown = exposed(so_far, c), e = shown - photograph, j = shown * (vec3(real(1)) - shown);
  const real w = slack / (slack + (abs(e.x) + abs(e.y) + abs(e.z)) / real(3));
  sums[0] += w * vec4(j * j, real(1));
  sums[1] += w * vec4(j * e, dot(e, e) / real(3));
}

/// The exposure that per channel minimises the mean of w e^2 to first order around so_far, plus pull (gain - start)^2.
/// pull is 0.625 times the mean squared error so far: a prior of 0.4 on gains if a photograph had as much information
/// as ten independent pixels. Rendering errors are correlated over large parts of a picture, hence the small number.
/// seen: weights of the pixels, as a share of a place's pixels. Below 0.01 the prior is stronger.
FN Exposure fitted_exposure(IN_ARRAY_OF(vec4, sums, EXPOSURE_SUMS), IN(Exposure) so_far, vec3 start, real seen) {
  const real inverse = real(1) / max(sums[0].w, real(1e-6)), error = inverse * sums[1].w;
  const real hardly = clamp(real(0.01) / max(seen, real(1e-6)), real(1), real(100)),
             pull = hardly * (real(0.625) * error + real(1e-5));
  const vec3 jj = inverse * vec3(sums[0]) + pull;
  Exposure m;
  m.gain = so_far.gain - (inverse * vec3(sums[1]) + pull * (so_far.gain - start)) / jj;
  m.variance = real(0.1) * error * (real(1) / jj.x + real(1) / jj.y + real(1) / jj.z) / real(3);
  return m;
}
