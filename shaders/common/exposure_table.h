// Exposures in memory: a vec4 for each of the EXPOSURE_PLACES of a photograph. Needs exposure.h.

FN Exposure load_exposure(Float4s table, uint row) {
  // Loads the whole vector: Mesa 22.3 with glslang's alignment reads the first component instead of the last if the
  // last is read alone through a pointer.
  const vec4 values = table.v[row];
  Exposure m;
  m.gain = vec3(values);
  m.variance = values.w;
  return m;
}

FN void store_exposure(Float4s table, uint row, IN(Exposure) m) { table.v[row] = vec4(m.gain, m.variance); }

/// The gains of a photograph at the corners of a square of its grid (exposure_square).
struct ExposureSquare {
  vec3 gain[4];
};

FN ExposureSquare load_square(Float4s table, uint photograph, uint first) {
  ExposureSquare s;
  UNROLL for (uint k = 0u; k < 4u; ++k) s.gain[k] =
      load_exposure(table, photograph * EXPOSURE_PLACES + exposure_corner(first, k)).gain;
  return s;
}

FN Exposure exposure_in(IN(ExposureSquare) s, vec4 weights) {
  Exposure m;
  m.gain = weights.x * s.gain[0] + weights.y * s.gain[1] + weights.z * s.gain[2] + weights.w * s.gain[3];
  m.variance = 0.0f;
  return m;
}

/// The centre of a pixel, 0..1 over the picture.
FN vec2 picture_point(uint x, uint y, uint width, uint height) {
  return vec2((float(x) + 0.5f) / float(width), (float(y) + 0.5f) / float(height));
}

/// The exposure of a photograph at a pixel.
FN Exposure exposure_at(Float4s table, uint photograph, uint x, uint y, uint width, uint height) {
  const vec2 at = picture_point(x, y, width, height);
  const uint first = exposure_square(at.x, at.y);
  return exposure_in(load_square(table, photograph, first), exposure_weights(at.x, at.y, first));
}
