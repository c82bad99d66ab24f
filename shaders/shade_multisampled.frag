// Second pass, four samples per pixel: shades once per triangle in the pixel and weights it by its samples.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/language.h"
#include "args/soup.h"
#include "common/coverage.h"
#include "common/ray_triangle.h"
#include "common/lattice.h"
#include "common/atlas.h"
#include "common/surface_colour.h"

layout(binding = 0) uniform usampler2DMS hits;
layout(location = 0) out vec4 colour;

void main() {
  const vec2 ndc = gl_FragCoord.xy * vec2(frame.pixel_x, frame.pixel_y) - 1.0;
  vec3 sum = vec3(0.0);
  int left = 15;  // samples still to be added, as bits
  uint hit[4];
  UNROLL for (int i = 0; i < 4; ++i) {
    hit[i] = texelFetch(hits, ivec2(gl_FragCoord.xy), i).x;
    if (hit[i] == 0u) {
      sum += frame.background.rgb;
      left &= ~(1 << i);
    }
  }
  while (left != 0) {
    const int i = findLSB(left);
    const uint h = i == 0 ? hit[0] : i == 1 ? hit[1] : i == 2 ? hit[2] : hit[3];
    int same = 0;
    UNROLL for (int j = 0; j < 4; ++j) if (hit[j] == h) same |= 1 << j;
    sum += float(bitCount(same & left)) * surface_colour(h, ndc);
    left &= ~same;
  }
  colour = vec4(0.25 * sum, 1.0);
}
