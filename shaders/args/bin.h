// Arguments of bin.comp.
#ifndef TRISOUP_ARGS_BIN_H
#define TRISOUP_ARGS_BIN_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Which triangles a tile of 8 x 8 pixels may show: count, then offsets, then lists.
struct BinArgs {
  POINTER(Views) views;
  POINTER(ScreenTriangles) screen;
  POINTER(Uints) counts;   // [tiles]: triangles of a tile, then the cursor of the fill
  POINTER(Uints) offsets;  // [tiles + 1]
  POINTER(Uints) lists;    // [capacity]
  POINTER(Controls) control;
  POINTER(Steps) state;
  uint triangles, view_count, tiles, capacity;
};

#ifndef GL_core_profile
}
#endif
#endif
