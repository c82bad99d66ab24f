// Exposure: a per-channel gain and offset between the scene's colours and a photograph's. They are fitted whenever a
// step renders the photograph (docs/method.md, "Exposure"): weighted least squares (Holland and Welsch 1977) with ridge
// regularisation towards the identity (Hoerl and Kennard 1970).

/// A colour c becomes gain c + offset, per channel.
struct Exposure {
  vec3 gain, offset;
  real variance;  // of a fitted gain, mean over the channels
};

FN vec3 exposed(IN(Exposure) m, vec3 c) { return m.gain * c + m.offset; }

/// Photographs are clipped to 0..1. A colour beyond the clipped end of its photograph counts as equal to it.
FN real recorded(real colour, real photograph) {
  if (photograph <= real(0)) return max(colour, real(0));
  if (photograph >= real(1)) return min(colour, real(1));
  return colour;
}
FN vec3 recorded(vec3 colour, vec3 photograph) {
  return vec3(recorded(colour.x, photograph.x), recorded(colour.y, photograph.y), recorded(colour.z, photograph.z));
}

/// Returns dL/dc of the colour c from d = dL/d(recorded colour). Clipped channels have no gradient.
FN vec3 recorded_backward(IN(Exposure) m, vec3 c, vec3 photograph, vec3 d) {
  const vec3 colour = exposed(m, c), shown = recorded(colour, photograph);
  return m.gain * vec3(shown.x == colour.x ? d.x : real(0), shown.y == colour.y ? d.y : real(0),
                       shown.z == colour.z ? d.z : real(0));
}

/// Removes the exposure common to all photographs from m: with share 1, applying first common_part and then the result
/// is m. A lower share moves the result towards the identity.
FN Exposure exposure_beyond(IN(Exposure) m, IN(Exposure) common_part, real share) {
  Exposure rest;
  rest.gain = m.gain / max(common_part.gain, vec3(real(0.01)));
  rest.offset = share * (m.offset - rest.gain * common_part.offset);
  rest.gain = real(1) + share * (rest.gain - real(1));
  rest.variance = m.variance;
  return rest;
}

/// Shrinkage factor of the exposures (James and Stein 1961): 0 if they spread no more than their uncertainty. spread:
/// variance of the gains over the photographs. noise: mean of the gains' own variances.
FN real exposure_share(real spread, real noise) { return spread > noise ? real(1) - noise / spread : real(0); }

// Sums over pixels that a fit needs: w (c c, 1), w (c, |e|^2 / 3), w (c d, 0) and w (d, 0), with products per channel.
// c: rendered colour; d: photograph minus c; e: error with the photograph's previous exposure; w: weight of the pixel.
#define EXPOSURE_SUMS 4

/// Adds a pixel. Where a rendering is wrong (holes, edges, transient objects) it says nothing about the exposure.
/// Weights 1 / (|e| + slack) make the fit nearly an L1 fit, like the loss.
FN void add_to_exposure(vec3 c, vec3 photograph, IN(Exposure) so_far, INOUT_ARRAY_OF(vec4, sums, EXPOSURE_SUMS)) {
  // For the brightest and darkest values of a photograph only a bound is known.
  if (min(photograph.x, min(photograph.y, photograph.z)) <= real(0) ||
      max(photograph.x, max(photograph.y, photograph.z)) >= real(1))
    return;
  const real slack = real(0.02);
  const vec3 d = photograph - c, e = exposed(so_far, c) - photograph;
  const real w = slack / (slack + (abs(e.x) + abs(e.y) + abs(e.z)) / real(3));
  sums[0] += w * vec4(c * c, real(1));
  sums[1] += w * vec4(c, dot(e, e) / real(3));
  sums[2] += w * vec4(c * d, real(0));
  sums[3] += w * vec4(d, real(0));
}

/// Per channel, minimises sum w (gain c + offset - p)^2 / sum w + pull ((gain - 1)^2 + 40 offset^2). pull is 2.5 times
/// the mean squared error so far: a prior of 0.2 on gains and 0.03 on offsets if a photograph had as much information
/// as ten independent pixels. Rendering errors are correlated over large parts of a picture, hence the small number.
FN Exposure fitted_exposure(IN_ARRAY_OF(vec4, sums, EXPOSURE_SUMS)) {
  const real inverse = real(1) / max(sums[0].w, real(1e-6));
  const real pull = real(2.5) * inverse * sums[1].w + real(1e-5);
  const vec3 cc = inverse * vec3(sums[0]) + pull, c = inverse * vec3(sums[1]), cd = inverse * vec3(sums[2]),
             d = inverse * vec3(sums[3]);
  const real one = real(1) + real(40) * pull;
  const vec3 determinant = one * cc - c * c;
  Exposure m;
  m.gain = real(1) + (one * cd - c * d) / determinant;
  m.offset = (cc * d - c * cd) / determinant;
  m.variance = real(0.1) * inverse * sums[1].w * (real(1) / cc.x + real(1) / cc.y + real(1) / cc.z) / real(3);
  return m;
}
