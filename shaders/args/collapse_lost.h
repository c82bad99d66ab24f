// Arguments of collapse_lost.comp.
#ifndef TRISOUP_ARGS_COLLAPSE_LOST_H
#define TRISOUP_ARGS_COLLAPSE_LOST_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Collapses triangles that have a non-finite vertex. One thread per triangle.
struct CollapseLostArgs {
  POINTER(Floats) vertices;  // [T][3][3]
  POINTER(Floats) moment1;   // [T][3][3]
  POINTER(Floats) moment2;   // [T][3]
  POINTER(Uints) collapsed;  // [1], added to: number of collapsed triangles
  uint triangles, pad;
};

#ifndef GL_core_profile
}
#endif
#endif
