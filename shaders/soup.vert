// First pass: a corner of a triangle of the soup. Fragment shaders fetch all other data of the triangle.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/language.h"
#include "args/soup.h"
#include "common/ray_triangle.h"

// As published, discard triangles that reach behind the camera instead of clipping them.
layout(constant_id = 0) const bool DROP_BEHIND = false;
layout(location = 0) in uvec4 in_vertex;  // SoupVertex
layout(binding = 5) uniform Frame { DrawFrame frame; };
#include "common/soup_table.h"

layout(location = 0) flat out uint triangle;  // index + 1

float depth_of(vec3 v) { return (frame.clip_from_world * vec4(v, 1.0)).w; }

void main() {
  triangle = in_vertex.w;
  const vec4 p = frame.clip_from_world * vec4(uintBitsToFloat(in_vertex.xyz), 1.0);
  // Depth is reversed, 1 near and 0 far, because floats are densest near 0, where perspective compresses far depths.
  gl_Position = vec4(p.xy, 0.5 * (p.w - p.z), p.w);
  if (DROP_BEHIND) {
    const SoupTriangle t = soup_triangle(triangle - 1u);
    if (min(depth_of(t.v2), min(depth_of(t.v2 + t.e0), depth_of(t.v2 + t.e1))) <= 0.0)
      gl_Position = vec4(2.0, 2.0, 0.0, 1.0);
  }
}
