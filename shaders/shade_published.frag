// Used only by soup-bench for comparison: the second pass of the published viewer, with features read from the first
// pass's output. It covers the whole picture. The MLP is evaluated as in shade.frag.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/language.h"
#include "args/soup.h"
#include "common/coverage.h"
#include "common/ray_triangle.h"
#include "common/lattice.h"
#include "common/atlas.h"
#include "common/surface_colour.h"

layout(binding = 0) uniform sampler2D low;
layout(binding = 3) uniform sampler2D high;
layout(location = 0) out vec4 colour;

void main() {
  const vec2 ndc = gl_FragCoord.xy * vec2(frame.pixel_x, frame.pixel_y) - 1.0;
  const vec4 l = texelFetch(low, ivec2(gl_FragCoord.xy), 0), h = texelFetch(high, ivec2(gl_FragCoord.xy), 0);
  colour = frame.background;
  if (h.w > 0.0) colour = vec4(neural_colour(float[8](l.x, l.y, l.z, l.w, h.x, h.y, h.z, h.w), ndc), 1.0);
}
