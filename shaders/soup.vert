// First pass: a triangle of the soup. Its barycentrics are evaluated per pixel from the same edge functions as in training, not
// interpolated from vertices that the rasteriser has snapped to its grid.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/language.h"
#include "args/soup.h"
#include "common/coverage.h"

layout(location = 0) in vec4 in_v0;
layout(location = 1) in vec4 in_v1;
layout(location = 2) in vec4 in_v2;
layout(location = 3) in uvec4 in_record;  // place, layer and level, index + 1
layout(push_constant) uniform Push { SoupArgs a; };

layout(location = 0) flat out vec3 e0;
layout(location = 1) flat out vec3 e1;
layout(location = 2) flat out vec3 sum;
layout(location = 3) flat out vec2 origin;
layout(location = 4) flat out uvec3 record;

void main() {
  const vec4 p0 = a.clip_from_world * vec4(in_v0.xyz, 1.0);
  const vec4 p1 = a.clip_from_world * vec4(in_v1.xyz, 1.0);
  const vec4 p2 = a.clip_from_world * vec4(in_v2.xyz, 1.0);
  const bool in_front = p0.w > 0.0 && p1.w > 0.0 && p2.w > 0.0;
  // An origin near the pixels keeps small triangles exact.
  const vec4 middle = p0 + p1 + p2;
  origin = in_front ? clamp(middle.xy / middle.w, vec2(-1.0), vec2(1.0)) : vec2(0.0);
  const TriangleSetup setup = triangle_setup(p0, p1, p2, origin);
  e0 = setup.e0;
  e1 = setup.e1;
  sum = setup.e0 + setup.e1 + setup.e2;
  record = in_record.xyz;
  const uint corner = uint(gl_VertexIndex) % 3u;
  const vec4 p = corner == 0u ? p0 : corner == 1u ? p1 : p2;
  // Depth is reversed, 1 near and 0 far: floats are dense where perspective crowds the far things.
  gl_Position = vec4(p.xy, 0.5 * (p.w - p.z), p.w);
  if (!setup.valid || (a.drop_behind != 0u && !in_front)) gl_Position = vec4(2.0, 2.0, 0.0, 1.0);
}
