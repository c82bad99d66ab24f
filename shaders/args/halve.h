// Arguments of halve.comp.
#ifndef TRISOUP_ARGS_HALVE_H
#define TRISOUP_ARGS_HALVE_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Halves rendering and photograph. One thread per pixel of the result.
struct HalveArgs {
  POINTER(Floats) colour;        // [height][width][3]
  POINTER(Uints) target;         // [height][width]: RGBA8, alpha is the loss mask; or
  POINTER(Floats) float_target;  // [height][width][3]
  POINTER(Floats) half_colour;   // [(height + 1) / 2][(width + 1) / 2][3]
  POINTER(Floats) half_target;   // the same
  uint width, height;
};

#ifndef GL_core_profile
}
#endif
#endif
