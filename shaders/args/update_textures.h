// Arguments of update_textures.comp.
#ifndef TRISOUP_ARGS_UPDATE_TEXTURES_H
#define TRISOUP_ARGS_UPDATE_TEXTURES_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Distributes the lattice gradient to all levels, applies Adam, sums the levels and applies the sigmoid. One workgroup
/// per task. Triangles whose gradient is zero everywhere are not changed.
struct UpdateTexturesArgs {
  POINTER(TextureTasks) tasks;  // tasks of this launch
  POINTER(Float4s) source;      // [source samples][8], logits
  POINTER(Float4s) moment1;
  POINTER(Float4s) moment2;
  POINTER(Float4s) lattice;
  POINTER(Floats) opacity;
  POINTER(Uints) counts;        // pixels that show each triangle, and their positions, from place_pixels
  POINTER(Floats) sorted;       // [9][pixels], from shade_backward
  POINTER(Uints) gradient_low;  // of opacities: [lattice samples], fixed point
  POINTER(Uints) gradient_high;
  POINTER(Uints) touched;  // [triangles]: 0 if the opacity gradient is known to be zero; set to 0 afterwards
  POINTER(Steps) state;
  POINTER(Controls) control;
  POINTER(Float4s) debug;  // [source samples][8]: gradient, if requested
  uint triangles;
  uint unseen;  // 1: also update values without a gradient, by their moments
  uint pixels, tasks_count;
};

#ifndef GL_core_profile
}
#endif
#endif
