// Arguments of paint_textures.comp.
#ifndef TRISOUP_ARGS_PAINT_TEXTURES_H
#define TRISOUP_ARGS_PAINT_TEXTURES_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Textures from the colours that sum_photographs.comp found. One workgroup per triangle.
struct PaintTexturesArgs {
  POINTER(Uints) parents;          // [triangles]: rows of old_textures
  POINTER(Textures) old_textures;  // of level 0: colours and opacity to begin with
  POINTER(Textures) textures;      // [triangles]
  POINTER(Float4s) old_source;
  POINTER(Float4s) source;  // [source samples][8], logits
  POINTER(Uints) low;       // [lattice samples][4], as sum_photographs.comp leaves them
  POINTER(Uints) high;
  uint triangles, pad;
};

#ifndef GL_core_profile
}
#endif
#endif
