// Exposures in memory, two vec4 per photograph, and colours of photographs. Needs exposure.h.

FN Exposure load_exposure(Float4s table, uint photograph) {
  // Loads whole vectors: Mesa 22.3 with glslang's alignment reads the first component instead of the last if the last
  // is read alone through a pointer.
  const vec4 gain = table.v[photograph * 2u];
  Exposure m;
  m.gain = vec3(gain);
  m.variance = gain.w;
  m.offset = vec3(table.v[photograph * 2u + 1u]);
  return m;
}

FN void store_exposure(Float4s table, uint photograph, IN(Exposure) m) {
  table.v[photograph * 2u] = vec4(m.gain, m.variance);
  table.v[photograph * 2u + 1u] = vec4(m.offset, 0.0f);
}

/// Converts RGBA8 to 0..1; 255 is exactly 1.
FN vec3 photograph_colour(uint rgba) {
  return vec3(float(rgba & 255u), float((rgba >> 8) & 255u), float((rgba >> 16) & 255u)) * (1.0f / 255.0f);
}
