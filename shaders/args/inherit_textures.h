// Arguments of inherit_textures.comp.
#ifndef TRISOUP_ARGS_INHERIT_TEXTURES_H
#define TRISOUP_ARGS_INHERIT_TEXTURES_H
#include "args/types.h"
#ifndef GL_core_profile
namespace trisoup::kernels {
#endif

/// Textures of a new topology: every triangle copies its parent's levels. One workgroup per triangle.
struct InheritTexturesArgs {
  POINTER(Uints) parents;  // [new T]
  POINTER(Textures) old_textures;
  POINTER(Textures) new_textures;
  POINTER(Floats) old_source;
  POINTER(Floats) new_source;
  uint triangles, pad;
};

#ifndef GL_core_profile
}
#endif
#endif
