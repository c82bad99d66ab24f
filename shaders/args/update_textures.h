// Arguments of update_textures.comp.
#ifndef TRISOUP_ARGS_UPDATE_TEXTURES_H
#define TRISOUP_ARGS_UPDATE_TEXTURES_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Lattice gradient to all levels, Adam, sum of the levels, sigmoid. One workgroup per task; a triangle whose gradient
/// is zero everywhere is left alone.
struct UpdateTexturesArgs {
  POINTER(TextureTasks) tasks;  // of this launch
  POINTER(Float4s) source;      // [source samples][8], logits
  POINTER(Float4s) moment1;
  POINTER(Float4s) moment2;
  POINTER(Float4s) lattice;
  POINTER(Floats) opacity;
  POINTER(Uints) counts;        // pixels that show each triangle, and their places: as place_pixels leaves them
  POINTER(Floats) sorted;       // [9][pixels], as shade_backward leaves them
  POINTER(Uints) gradient_low;  // of opacities: [lattice samples], fixed point
  POINTER(Uints) gradient_high;
  POINTER(Uints) touched;  // [triangles]: 0 where the gradient of opacities is known to be zero; 0 afterwards
  POINTER(Steps) state;
  POINTER(Controls) control;
  POINTER(Float4s) debug;  // [source samples][8]: gradient where asked for
  uint triangles;
  uint unseen;  // 1: also values without a gradient, by their moments
  uint pixels, tasks_count;
};

#ifndef GL_core_profile
}
#endif
#endif
