// Arguments of measure_visible.comp.
#ifndef TRISOUP_ARGS_MEASURE_VISIBLE_H
#define TRISOUP_ARGS_MEASURE_VISIBLE_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Largest size of each triangle in pixels of the photographs, and the views that show it. One workgroup per tile.
struct MeasureVisibleArgs {
  POINTER(Views) views;
  POINTER(ScreenTriangles) screen;
  POINTER(Hits) hits;
  POINTER(Uints) areas;  // [T], maximum with the existing value; at most 2^30
  POINTER(Uints) shown;  // [T]: bit v is set if view v of the batch shows it; at most 32 views
  uint triangles, view_count, tiles, pad;
};

#ifndef GL_core_profile
}
#endif
#endif
