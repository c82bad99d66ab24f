// Arguments of hide_triangles.comp.
#ifndef TRISOUP_ARGS_HIDE_TRIANGLES_H
#define TRISOUP_ARGS_HIDE_TRIANGLES_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Removes hidden triangles from the projected ones. One thread per (view, triangle).
struct HideTrianglesArgs {
  POINTER(ScreenTriangles) screen;  // [views][T]: boxes of hidden triangles become empty
  POINTER(Uints) flags;             // [T]: bit 0: hidden
  uint triangles, view_count;
};

#ifndef GL_core_profile
}
#endif
#endif
