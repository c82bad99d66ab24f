// First pass, four samples per pixel. Opacity is tested at each sample, extrapolated from the centre with its screen
// gradient, so that edges inside a triangle are as smooth as its outline. A separate shader, because a shader that
// writes the sample mask only on some paths leaves it undefined on the others.
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
  // Standard sample locations relative to the centre.
  const vec4 at_x = vec4(-0.125, 0.375, -0.375, 0.125), at_y = vec4(-0.375, -0.125, 0.125, 0.375);
  const bvec4 solid = greaterThanEqual(vec4(alpha) + at_x * x + at_y * y, vec4(0.5));
  const int mask = int(solid.x) | (int(solid.y) << 1) | (int(solid.z) << 2) | (int(solid.w) << 3);
  if (mask == 0) discard;
  gl_SampleMask[0] = mask;
  hit = triangle;
}
