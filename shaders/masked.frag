// First pass, one sample per pixel: tests the opacity at the pixel centre.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/language.h"
#include "args/soup.h"
#include "common/ray_triangle.h"
#include "common/lattice.h"
#include "common/atlas.h"
#include "common/first_pass.h"

void main() {
  if (opacity() < 0.5) discard;
  hit = triangle;
}
