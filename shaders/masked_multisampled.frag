// First pass, four samples per pixel: opacity decides at each of them, continued from the middle by its slope on the screen, so
// that edges within a triangle are as smooth as its outline. A shader of its own: one that writes a sample mask on some paths only
// leaves it undefined on the others.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/language.h"
#include "args/soup.h"
#include "common/ray_triangle.h"
#include "common/lattice.h"
#include "common/atlas.h"
#include "common/first_pass.h"

void main() {
  const float alpha = opacity(), x = dFdx(alpha), y = dFdy(alpha);
  // Standard sample locations, relative to the middle.
  const vec4 at_x = vec4(-0.125, 0.375, -0.375, 0.125), at_y = vec4(-0.375, -0.125, 0.125, 0.375);
  const bvec4 solid = greaterThanEqual(vec4(alpha) + at_x * x + at_y * y, vec4(0.5));
  const int mask = int(solid.x) | (int(solid.y) << 1) | (int(solid.z) << 2) | (int(solid.w) << 3);
  if (mask == 0) discard;
  gl_SampleMask[0] = mask;
  hit = triangle;
}
