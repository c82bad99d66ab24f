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
