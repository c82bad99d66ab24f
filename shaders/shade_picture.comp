// Second pass with one sample per pixel as a compute kernel; gives the colours of shade.frag. It is faster on GPUs with
// few fragment units. It uses images, which other backends lack, so it is compiled only as GLSL.
#include "common/language.h"
#include "args/soup.h"
#include "common/coverage.h"
#include "common/ray_triangle.h"
#include "common/lattice.h"
#include "common/atlas.h"
#include "common/surface_colour.h"

layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0) uniform usampler2D hits;
layout(binding = 6, rgba8) uniform writeonly image2D picture;

void main() {
  const ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(pixel, imageSize(picture)))) return;
  const uint hit = texelFetch(hits, pixel, 0).x;
  vec4 colour = frame.background;
  if (hit != 0u) {
    // Same pixel centre as gl_FragCoord.
    const vec2 ndc = (vec2(pixel) + 0.5) * vec2(frame.pixel_x, frame.pixel_y) - 1.0;
    colour = vec4(surface_colour(hit, ndc), 1.0);
  }
  imageStore(picture, pixel, colour);
}
