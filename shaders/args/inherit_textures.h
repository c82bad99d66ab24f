// Arguments of inherit_textures.comp.
#ifndef TRISOUP_ARGS_INHERIT_TEXTURES_H
#define TRISOUP_ARGS_INHERIT_TEXTURES_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Textures after a refinement. Every triangle inherits its part of its parent's texture; the sum of the levels is
/// preserved. One workgroup per triangle.
struct InheritTexturesArgs {
  POINTER(Uints) parents;   // [new T]
  POINTER(Floats) corners;  // [new T][3][2]: b0, b1 of the triangle's corners in its parent
  POINTER(Textures) old_textures;
  POINTER(Textures) new_textures;
  POINTER(Floats) old_source;
  POINTER(CoherentFloats) new_source;
  uint triangles;
  uint copy;  // 1, as published: as if every triangle were its whole parent; corners are not read
};

#ifndef GL_core_profile
}
#endif
#endif
