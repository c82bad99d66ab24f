// Blends a colour over the pixels that show a marked triangle.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/language.h"
#include "args/soup.h"
#include "args/interface.h"

layout(push_constant) uniform Push { TintArgs a; };
layout(binding = 0) uniform usampler2D hits;  // of the first pass, possibly smaller than the picture
layout(binding = 1) uniform sampler2D marks;  // 1 for marked triangles, 0 for others; as wide as the table of triangles
layout(location = 0) out vec4 colour;

void main() {
  const vec2 ratio = vec2(textureSize(hits, 0)) / vec2(a.width, a.height);
  const uint hit = texelFetch(hits, ivec2(gl_FragCoord.xy * ratio), 0).x;
  if (hit == 0u) discard;
  const ivec2 column = ivec2(int((hit - 1u) % kTableWidth), int((hit - 1u) / kTableWidth));
  colour = vec4(a.red, a.green, a.blue, a.alpha * texelFetch(marks, column, 0).x);
}
