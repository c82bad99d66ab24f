// For comparison in soup-bench alone: the first pass of the published viewer, which fetches both textures for every fragment,
// hidden ones too, and writes both.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/language.h"
#include "args/soup.h"
#include "common/coverage.h"
#include "common/lattice.h"
#include "common/atlas.h"

layout(push_constant) uniform Push { SoupArgs a; };
layout(binding = 0) uniform sampler2DArray low;   // features 0..3
layout(binding = 1) uniform sampler2DArray high;  // features 4..6, opacity

layout(location = 0) flat in vec3 e0;
layout(location = 1) flat in vec3 e1;
layout(location = 2) flat in vec3 sum;
layout(location = 3) flat in vec2 origin;
layout(location = 4) flat in uvec3 record;
layout(location = 0) out vec4 out_low;
layout(location = 1) out vec4 out_high;

void main() {
  const vec2 d = gl_FragCoord.xy * vec2(a.pixel_x, a.pixel_y) - 1.0 - origin;
  const float scale = 1.0 / at_offset(sum, d), b0 = clamp(at_offset(e0, d) * scale, 0.0, 1.0);
  const float b1 = clamp(at_offset(e1, d) * scale, 0.0, 1.0 - b0);
  const uint level = record.y & 255u;
  const LatticeSquare square = lattice_square(b0, b1, level);
  const AtlasSquare s = atlas_square(record.x, record.y, square);
  const SquareWeights w = square_weights(square, level);
  const ivec3 i0 = ivec3(s.at + ivec2(s.step, 0), s.page), i1 = ivec3(s.at + ivec2(0, s.step), s.page);
  const ivec3 i2 = ivec3(s.at + (w.upper ? ivec2(s.step) : ivec2(0)), s.page);
  const vec4 h2 = texelFetch(high, i2, 0);
  out_high = h2 + w.w0 * (texelFetch(high, i0, 0) - h2) + w.w1 * (texelFetch(high, i1, 0) - h2);
  const vec4 l2 = texelFetch(low, i2, 0);
  out_low = l2 + w.w0 * (texelFetch(low, i0, 0) - l2) + w.w1 * (texelFetch(low, i1, 0) - l2);
  if (out_high.a < 0.5) discard;
}
