// Second pass, 2 x 2 samples per pixel, each shaded separately.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/language.h"
#include "args/soup.h"
#include "common/coverage.h"
#include "common/ray_triangle.h"
#include "common/lattice.h"
#include "common/atlas.h"
#include "common/surface_colour.h"

layout(binding = 0) uniform usampler2D hits;  // twice the width and height
layout(location = 0) out vec4 colour;

void main() {
  const vec2 pixel = vec2(frame.pixel_x, frame.pixel_y);
  vec3 sum = vec3(0.0);
  int left = 15;  // samples still to be added, as bits
  uint hit[4];
  UNROLL for (int i = 0; i < 4; ++i) {
    hit[i] = texelFetch(hits, 2 * ivec2(gl_FragCoord.xy) + ivec2(i & 1, i >> 1), 0).x;
    if (hit[i] == 0u) {
      sum += frame.background.rgb;
      left &= ~(1 << i);
    }
  }
  // On a CPU the loop's trip count saves work, a branch does not.
  for (; left != 0; left &= left - 1) {
    const int i = findLSB(left);
    const uint h = i == 0 ? hit[0] : i == 1 ? hit[1] : i == 2 ? hit[2] : hit[3];
    const vec2 offset = vec2(i & 1, i >> 1) * 0.5 - 0.25;
    sum += surface_colour(h, (gl_FragCoord.xy + offset) * pixel - 1.0);
  }
  colour = vec4(0.25 * sum, 1.0);
}
