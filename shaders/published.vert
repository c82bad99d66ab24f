// Used only by soup-bench for comparison: the vertex stage of the published viewer, which lets the rasteriser
// interpolate barycentrics.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/language.h"
#include "args/soup.h"

layout(location = 0) in vec4 in_position;  // normalised coordinates
layout(location = 1) in uvec4 in_record;   // atlas position; layer and level
layout(binding = 5) uniform Frame { DrawFrame frame; };

layout(location = 0) out vec2 barycentrics;
layout(location = 1) flat out uvec2 record;

void main() {
  const uint corner = uint(gl_VertexIndex) % 3u;
  barycentrics = vec2(corner == 0u, corner == 1u);
  record = in_record.xy;
  const vec4 p = frame.clip_from_world * vec4(in_position.xyz, 1.0);
  gl_Position = vec4(p.xy, 0.5 * (p.w - p.z), p.w);
}
