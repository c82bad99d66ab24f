// Comparison of a rendering with its photograph in the viewer.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "args/interface.h"

layout(push_constant) uniform Push { CompareArgs a; };
layout(binding = 0) uniform sampler2D rendering;
layout(binding = 1) uniform sampler2D photograph;  // same camera, possibly another size
layout(location = 0) out vec4 colour;

void main() {
  const vec3 ours = texelFetch(rendering, ivec2(gl_FragCoord.xy), 0).rgb;
  // As in render::reshaped: heights and centres match.
  const vec2 size = vec2(textureSize(photograph, 0));
  const vec2 at = (gl_FragCoord.xy - 0.5 * vec2(a.width, a.height)) * (size.y / a.height) + 0.5 * size;
  const bool inside = all(greaterThanEqual(at, vec2(0.0))) && all(lessThan(at, size));
  const vec3 photo = texelFetch(photograph, ivec2(clamp(at, vec2(0.0), size - 1.0)), 0).rgb;
  colour = vec4(ours, 1.0);
  if (inside && a.error != 0u) colour.rgb = min(4.0 * abs(ours - photo), vec3(1.0));
  if (inside && a.error == 0u && gl_FragCoord.x < a.split * a.width) colour.rgb = photo;
  // The slider's line.
  if (a.error == 0u && a.split > 0.0 && a.split < 1.0 && abs(gl_FragCoord.x - a.split * a.width) < 1.0)
    colour.rgb = vec3(1.0, 0.8, 0.2);
}
