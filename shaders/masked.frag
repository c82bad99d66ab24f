// First pass, one sample per pixel: the opacity in the middle of the pixel decides.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/language.h"
#include "args/soup.h"
#include "common/coverage.h"
#include "common/lattice.h"
#include "common/atlas.h"
#include "common/first_pass.h"

void main() {
  const vec2 b = barycentrics();
  if (opacity(b.x, b.y) < 0.5) discard;
  hit = hit_at(b);
}
