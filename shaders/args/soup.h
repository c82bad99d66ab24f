// Arguments of soup.vert and of the fragment shaders of the first pass.
#ifndef TRISOUP_ARGS_SOUP_H
#define TRISOUP_ARGS_SOUP_H
#include "args/types.h"
#ifdef GL_core_profile
#define STRUCT struct
#else
namespace KERNEL_TYPES {
#define STRUCT struct alignas(16)
#endif

/// Size of the first pass's picture. With 2 x 2 samples per pixel it is larger than the second's.
STRUCT SoupArgs {
  float pixel_x, pixel_y;  // NDC per pixel: 2 / width, 2 / height
};

/// Width of the table of triangles: triangle t is column (t % width, t / width).
#ifdef GL_core_profile
#define kTableWidth 1024u
#else
inline constexpr uint kTableWidth = 1024;
#endif

/// A vertex of the first pass, four uints.
STRUCT SoupVertex {
  uint x, y, z;   // normalised coordinates, the bits of floats
  uint triangle;  // index + 1
};

/// Uniform buffer for both passes of a picture.
STRUCT DrawFrame {
  mat4 clip_from_world;    // OpenGL clip space, image rows downwards
  vec4 eye;                // normalised coordinates
  vec4 ray, ray_x, ray_y;  // as in ViewRecord
  vec4 background;
  float pixel_x, pixel_y;       // NDC per pixel
  float depth_near, depth_far;  // for the depth mode, along the viewing direction
  uint channel;                 // for the channel mode
  uint pad0, pad1, pad2;
};

#ifndef GL_core_profile
static_assert(sizeof(SoupVertex) == 16 && sizeof(DrawFrame) == 176);
}
#endif
#undef STRUCT
#endif
