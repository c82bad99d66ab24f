// Arguments of upsample_textures.comp.
#ifndef TRISOUP_ARGS_LIFT_TEXTURES_H
#define TRISOUP_ARGS_LIFT_TEXTURES_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Coarse to fine: a new level starts with the old texture sampled at its points.
struct UpsampleTexturesArgs {
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
