// Colour spaces and error of FLIP for pictures of low dynamic range (Andersson et al. 2020, "FLIP: A Difference
// Evaluator for Alternating Images"), with its constants. Needs powers.h and photograph.h.

// The matrices have sRGB's primaries and white (IEC 61966-2-1).

/// XYZ of a white pixel.
FN vec3 white_xyz() { return vec3(0.95042855f, 1.0f, 1.0889004f); }

/// Display value of one channel, 0..1, to light.
FN float light_of(float shown) {
  return shown <= 0.04045f ? shown * (1.0f / 12.92f) : power((shown + 0.055f) * (1.0f / 1.055f), 2.4f);
}

/// XYZ divided by white_xyz().
FN vec3 relative_xyz(vec3 light) {
  return vec3(dot(light, vec3(0.41238657f, 0.35759149f, 0.18045049f)) * (1.0f / 0.95042855f),
              dot(light, vec3(0.21263682f, 0.71518298f, 0.07218020f)),
              dot(light, vec3(0.01933062f, 0.11919716f, 0.95037260f)) * (1.0f / 1.0889004f));
}

/// The inverse, clamped to colours that a display shows.
FN vec3 shown_light(vec3 xyz) {
  const vec3 at = xyz * white_xyz();
  return clamp(vec3(dot(at, vec3(3.24100326f, -1.53739892f, -0.49861587f)),
                    dot(at, vec3(-0.96922425f, 1.87592999f, 0.04155422f)),
                    dot(at, vec3(0.05563942f, -0.20401121f, 1.05714898f))),
               vec3(0.0f), vec3(1.0f));
}

/// Opponent colours: relative Y, X - Y, Y - Z. YyCxCz is 116 Y - 16, 500 (X - Y), 200 (Y - Z).
FN vec3 opponent(vec3 shown) {
  const vec3 xyz = relative_xyz(vec3(light_of(shown.x), light_of(shown.y), light_of(shown.z)));
  return vec3(xyz.y, xyz.x - xyz.y, xyz.y - xyz.z);
}

/// The curve of CIELab.
FN float lab_curve(float t) { return t > 0.008856452f ? power(t, 0.33333333f) : t * 7.787037f + 0.13793103f; }

/// CIELab of filtered opponent colours, with chroma scaled by lightness (Hunt effect).
FN vec3 hunt_lab(vec3 filtered) {
  const vec3 light = shown_light(vec3(filtered.x + filtered.y, filtered.x, filtered.x - filtered.z));
  const vec3 xyz = relative_xyz(light);
  const float x = lab_curve(xyz.x), y = lab_curve(xyz.y), z = lab_curve(xyz.z);
  const float lightness = 116.0f * y - 16.0f, scale = 0.01f * lightness;
  return vec3(lightness, scale * 500.0f * (x - y), scale * 200.0f * (y - z));
}

/// Error of two filtered colours, 0..1. most: the error between green and blue, raised to 0.7.
FN float colour_error(vec3 first, vec3 second, float most) {
  const vec3 d = hunt_lab(first) - hunt_lab(second);
  const float error = power(abs(d.x) + sqrt(d.y * d.y + d.z * d.z), 0.7f), knee = 0.4f * most;
  return error < knee ? 0.95f / knee * error : 0.95f + 0.05f * (error - knee) / (most - knee);
}
