// Arguments of depth_gradient.comp.
#ifndef TRISOUP_ARGS_DEPTH_GRADIENT_H
#define TRISOUP_ARGS_DEPTH_GRADIENT_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Vertex gradients of the depth loss. One workgroup per tile of 8 x 8 pixels.
struct DepthGradientArgs {
  POINTER(Views) views;
  POINTER(Hits) hits;
  POINTER(ScreenTriangles) screen;
  POINTER(Float4s) gradient;  // [pixels]: w below 0 where masked out
  POINTER(Steps) state;
  POINTER(Uints) vertex_low;  // [T][3][3], fixed point, normalised coordinates
  POINTER(Uints) vertex_high;
  uint tiles, view_count, triangles, pad;
};

#ifndef GL_core_profile
}
#endif
#endif
