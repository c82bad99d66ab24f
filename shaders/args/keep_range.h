// Arguments of keep_range.comp.
#ifndef TRISOUP_ARGS_KEEP_RANGE_H
#define TRISOUP_ARGS_KEEP_RANGE_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Limits the triangles that tiles list to a range. One thread per (view, triangle).
struct KeepRangeArgs {
  POINTER(ScreenTriangles) screen;  // [views][T]: boxes of triangles outside first .. last - 1 become empty
  uint triangles, view_count;
  uint first, last;
};

#ifndef GL_core_profile
}
#endif
#endif
