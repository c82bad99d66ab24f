// Arguments of lift_textures.comp.
#ifndef TRISOUP_ARGS_LIFT_TEXTURES_H
#define TRISOUP_ARGS_LIFT_TEXTURES_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// New levels from coarse ones: a level of the new texture starts with the old one looked up at its samples.
struct LiftTexturesArgs {
  POINTER(Textures) old_textures;
  POINTER(Textures) new_textures;
  POINTER(Floats) old_source;
  POINTER(Floats) new_source;
  uint triangles, keep_opacity;
};

#ifndef GL_core_profile
}
#endif
#endif
