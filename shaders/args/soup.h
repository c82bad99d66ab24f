// Arguments of soup.vert and of the fragment shaders of the first pass.
#ifndef TRISOUP_ARGS_SOUP_H
#define TRISOUP_ARGS_SOUP_H
#include "args/types.h"
#ifdef GL_core_profile
#define STRUCT struct
#else
namespace trisoup::kernels {
#define STRUCT struct alignas(16)
#endif

/// The first pass: triangles to the nearest fragment whose opacity is at least a half.
STRUCT SoupArgs {
  mat4 clip_from_world;  // OpenGL clip space, rows downwards
  float pixel_x, pixel_y;  // NDC per pixel: 2 / width, 2 / height
  uint drop_behind;        // 1: a triangle with a vertex behind the camera is left out whole, as in training; 0: clipped
  uint pad0;
};

/// Width of the image of places: triangle t is its texel (t % width, t / width).
#ifdef GL_core_profile
#define kPlacesWidth 1024u
#else
inline constexpr uint kPlacesWidth = 1024;
#endif

/// A vertex of the first pass: it knows its whole triangle. Three 4-vectors of floats, then one of uints.
STRUCT SoupVertex {
  vec4 v0, v1, v2;   // world
  uint place;        // x0 | y0 << 16, see soup::AtlasPlace
  uint layer_level;  // level | page << 8 | turned << 16
  uint triangle;     // index + 1
  uint pad0;
};

/// What the second pass knows of a picture; a uniform buffer.
STRUCT ShadeFrame {
  mat4 clip_from_world;
  vec4 ray, ray_x, ray_y;  // as in ViewRecord
  vec4 background;
  float pixel_x, pixel_y;  // NDC per pixel
  float depth_near, depth_far;  // of the depth mode, along the viewing direction
  uint channel;            // of the channel mode
  uint pad0;
  POINTER(Floats) vertices;  // [T][3][3], world
};

#ifndef GL_core_profile
static_assert(sizeof(SoupVertex) == 64 && sizeof(SoupArgs) == 80 && sizeof(ShadeFrame) == 160);
}
#endif
#undef STRUCT
#endif
