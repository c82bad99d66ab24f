// Arguments of paint_textures.comp.
#ifndef TRISOUP_ARGS_PAINT_TEXTURES_H
#define TRISOUP_ARGS_PAINT_TEXTURES_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Textures from the colours summed by sum_photographs.comp. One workgroup per triangle.
struct PaintTexturesArgs {
  POINTER(Uints) parents;          // [triangles]: rows of old_textures
  POINTER(Textures) old_textures;  // level 0: initial colours and opacity
  POINTER(Textures) textures;      // [triangles]
  POINTER(Float4s) old_source;
  POINTER(Float4s) source;  // [source samples][8], logits
  POINTER(Uints) low;       // [lattice samples][4], from sum_photographs.comp
  POINTER(Uints) high;
  uint triangles, pad;
};

#ifndef GL_core_profile
}
#endif
#endif
