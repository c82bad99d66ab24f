// Arguments of hide_triangles.comp.
#ifndef TRISOUP_ARGS_HIDE_TRIANGLES_H
#define TRISOUP_ARGS_HIDE_TRIANGLES_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Leaves out some of the triangles that were projected. One thread per (view, triangle).
struct HideTrianglesArgs {
  POINTER(ScreenTriangles) screen;  // [views][T]: boxes of hidden triangles become empty
  POINTER(Uints) flags;             // [T]: bit 0 is set where the triangle is hidden
  uint triangles, view_count;
};

#ifndef GL_core_profile
}
#endif
#endif
