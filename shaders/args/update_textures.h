// Arguments of update_textures.comp.
#ifndef TRISOUP_ARGS_UPDATE_TEXTURES_H
#define TRISOUP_ARGS_UPDATE_TEXTURES_H
#include "args/types.h"
#ifndef GL_core_profile
namespace trisoup::kernels {
#endif

/// Lattice gradient to all levels, Adam, sum of the levels, sigmoid. One workgroup per triangle.
struct UpdateTexturesArgs {
  POINTER(Textures) textures;
  POINTER(Floats) source;   // [source samples][8], logits
  POINTER(Floats) moment1;
  POINTER(Floats) moment2;
  POINTER(Floats) lattice;
  POINTER(Floats) opacity;
  POINTER(Uints) gradient_low;
  POINTER(Uints) gradient_high;
  POINTER(Steps) state;
  POINTER(Controls) control;
  POINTER(Floats) debug;    // [source samples][8]: gradient where asked for
  uint triangles, pad;
};

#ifndef GL_core_profile
}
#endif
#endif
