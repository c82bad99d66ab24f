// Arguments of opacity_backward.comp.
#ifndef TRISOUP_ARGS_OPACITY_BACKWARD_H
#define TRISOUP_ARGS_OPACITY_BACKWARD_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Likelihood-ratio gradient of opacity for every fragment up to the visible one. One workgroup per tile of a band.
struct OpacityBackwardArgs {
  POINTER(Views) views;
  POINTER(ScreenTriangles) screen;
  POINTER(Uints) offsets;
  POINTER(Uints) lists;
  POINTER(Textures) textures;
  POINTER(Floats) opacity;
  POINTER(Hits) hits;
  POINTER(Floats) gradient;
  POINTER(Steps) state;
  POINTER(Uints) gradient_low;  // [lattice samples], fixed point
  POINTER(Uints) gradient_high;
  POINTER(Uints) touched;  // [triangles]: 1 if a gradient was added; see update_textures
  uint triangles, view_count, tile_first, tiles, capacity, pad;
};

#ifndef GL_core_profile
}
#endif
#endif
