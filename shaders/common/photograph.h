// Pixels of photographs: RGBA, 8 bits each, red in the lowest. See trisoup::Image for alpha.

/// Whether a pixel counts in losses and metrics: its alpha is 128 or more. The others are masked out.
FN bool in_mask(uint rgba) { return rgba >= 0x80000000u; }

/// Share of a pixel inside the mask, or of a mean of such pixels, that hides the background. alpha: 0..255.
FN float coverage(float alpha) { return clamp((alpha - 128.0f) * (1.0f / 127.0f), 0.0f, 1.0f); }

/// Converts RGBA8 to 0..1; 255 is exactly 1.
FN vec3 photograph_colour(uint rgba) {
  const float unit = 1.0f / 255.0f;
  return vec3(float(rgba & 255u) * unit, float((rgba >> 8) & 255u) * unit, float((rgba >> 16) & 255u) * unit);
}

/// Background of a view: its own (ViewRecord::background), or the batch's if it has none.
FN vec3 background_of(uint own, vec3 batch) { return (own >> 24) != 0u ? photograph_colour(own) : batch; }
