// Arguments of collapse_lost.comp.
#ifndef TRISOUP_ARGS_COLLAPSE_LOST_H
#define TRISOUP_ARGS_COLLAPSE_LOST_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Takes triangles with a vertex that is not a number out of every picture. One thread per triangle.
struct CollapseLostArgs {
  POINTER(Floats) vertices;  // [T][3][3]
  POINTER(Floats) moment1;   // [T][3][3]
  POINTER(Floats) moment2;   // [T][3]
  POINTER(Uints) collapsed;  // how many there were
  uint triangles, pad;
};

#ifndef GL_core_profile
}
#endif
#endif
