// First pass: what the fragment shaders share. Opacities are all they fetch, one byte per lattice point, four at once.

layout(push_constant) uniform Push { SoupArgs a; };
layout(binding = 0) uniform sampler2DArray opacities;

layout(location = 0) flat in vec3 e0;
layout(location = 1) flat in vec3 e1;
layout(location = 2) flat in vec3 sum;
layout(location = 3) flat in vec2 origin;
layout(location = 4) flat in uvec3 record;
layout(location = 0) out uvec2 hit;  // index + 1, barycentrics

float opacity(float b0, float b1) {
  const uint level = record.y & 255u;
  const LatticeSquare square = lattice_square(b0, b1, level);
  const AtlasSquare s = atlas_square(record.x, record.y, square);
  // The corner that the square's four texels share.
  const vec2 middle = vec2(s.at) + 0.5 + 0.5 * float(s.step);
  const vec4 g = textureGather(opacities, vec3(middle / vec2(textureSize(opacities, 0).xy), float(s.page)));
  const bool turned = s.step < 0;
  const float v00 = turned ? g.y : g.w, v10 = turned ? g.x : g.z, v01 = turned ? g.z : g.x, v11 = turned ? g.w : g.y;
  const SquareWeights w = square_weights(square, level);
  const float v2 = w.upper ? v11 : v00;
  return v2 + w.w0 * (v10 - v2) + w.w1 * (v01 - v2);
}

/// Barycentrics b0, b1 of the middle of the pixel; with several samples it may lie outside, and is moved to the edge.
vec2 barycentrics() {
  const vec2 d = gl_FragCoord.xy * vec2(a.pixel_x, a.pixel_y) - 1.0 - origin;
  const float scale = 1.0 / at_offset(sum, d), b0 = clamp(at_offset(e0, d) * scale, 0.0, 1.0);
  return vec2(b0, clamp(at_offset(e1, d) * scale, 0.0, 1.0 - b0));
}

uvec2 hit_at(vec2 b) { return uvec2(record.z, packUnorm2x16(b)); }
