// Used only by soup-bench for comparison: the first pass of the published viewer. It reads and writes both textures for
// every fragment, including hidden ones.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/language.h"
#include "args/soup.h"
#include "common/lattice.h"
#include "common/atlas.h"

layout(binding = 0) uniform sampler2DArray low;   // features 0..3
layout(binding = 1) uniform sampler2DArray high;  // features 4..6, opacity

layout(location = 0) in vec2 barycentrics;
layout(location = 1) flat in uvec2 record;
layout(location = 0) out vec4 out_low;
layout(location = 1) out vec4 out_high;

void main() {
  const float b0 = clamp(barycentrics.x, 0.0, 1.0), b1 = clamp(barycentrics.y, 0.0, 1.0 - b0);
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
