// Exposures in memory, two vec4 for each photograph, and the colours of photographs. Needs exposure.h.

FN Exposure load_exposure(Float4s table, uint photograph) {
  // Whole vectors: where a last component alone is read through a pointer, Mesa 22.3 with glslang's alignment reads the
  // first.
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

/// 0..1 of RGBA8; 255 is exactly 1.
FN vec3 photograph_colour(uint rgba) {
  return vec3(float(rgba & 255u), float((rgba >> 8) & 255u), float((rgba >> 16) & 255u)) * (1.0f / 255.0f);
}
