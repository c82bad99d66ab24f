// Second pass, one sample per pixel. The depth test skips pixels that the first pass did not draw.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/language.h"
#include "args/soup.h"
#include "common/coverage.h"
#include "common/ray_triangle.h"
#include "common/lattice.h"
#include "common/atlas.h"
#include "common/surface_colour.h"

layout(binding = 0) uniform usampler2D hits;
layout(location = 0) out vec4 colour;

void main() {
  const vec2 ndc = gl_FragCoord.xy * vec2(frame.pixel_x, frame.pixel_y) - 1.0;
  colour = vec4(surface_colour(texelFetch(hits, ivec2(gl_FragCoord.xy), 0).x, ndc), 1.0);
}
