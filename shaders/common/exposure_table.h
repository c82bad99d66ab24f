// Exposures in memory, a vec4 per photograph. Needs exposure.h.

FN Exposure load_exposure(Float4s table, uint photograph) {
  // Loads the whole vector: Mesa 22.3 with glslang's alignment reads the first component instead of the last if the
  // last is read alone through a pointer.
  const vec4 row = table.v[photograph];
  Exposure m;
  m.gain = vec3(row);
  m.variance = row.w;
  return m;
}

FN void store_exposure(Float4s table, uint photograph, IN(Exposure) m) {
  table.v[photograph] = vec4(m.gain, m.variance);
}
