// Shared by the fragment shaders of the first pass. They fetch only opacities, one byte per lattice point, four at
// once.

layout(push_constant) uniform Push { SoupArgs a; };
layout(binding = 0) uniform sampler2DArray opacities;
layout(binding = 5) uniform BatchBuffers { DrawFrame frame; };
#include "common/soup_table.h"

layout(location = 0) flat in uint triangle;  // index + 1
layout(location = 0) out uint hit;           // the same

/// Returns the opacity of the triangle at the pixel centre.
float opacity() {
  const SoupTriangle t = soup_triangle(triangle - 1u);
  const vec2 b = barycentrics(t, gl_FragCoord.xy * vec2(a.pixel_x, a.pixel_y) - 1.0);
  const uint level = t.layer_level & 255u;
  const LatticeSquare square = lattice_square(b.x, b.y, level);
  const AtlasSquare s = atlas_square(t.place, t.layer_level, square);
  // The common corner of the square's four texels.
  const vec2 middle = vec2(s.at) + 0.5 + 0.5 * float(s.step);
  const vec4 g = textureGather(opacities, vec3(middle / vec2(textureSize(opacities, 0).xy), float(s.page)));
  const bool turned = s.step < 0;
  const float v00 = turned ? g.y : g.w, v10 = turned ? g.x : g.z, v01 = turned ? g.z : g.x, v11 = turned ? g.w : g.y;
  const SquareWeights w = square_weights(square, level);
  const float v2 = w.upper ? v11 : v00;
  return v2 + w.w0 * (v10 - v2) + w.w1 * (v01 - v2);
}
