// Panels of the viewer: textured, coloured triangles in pixels.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "args/interface.h"

layout(location = 0) in vec4 place;    // position, texture coordinates
layout(location = 1) in uvec4 colour;  // RGBA8, red in the lowest byte
layout(push_constant) uniform Push { InterfaceArgs a; };
layout(location = 0) out vec2 uv;
layout(location = 1) out vec4 tint;

void main() {
  uv = place.zw;
  tint = unpackUnorm4x8(colour.x);
  gl_Position = vec4(place.xy * vec2(a.scale_x, a.scale_y) + vec2(a.offset_x, a.offset_y), 0.0, 1.0);
}
