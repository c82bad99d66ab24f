// Arguments of bin.comp.
#ifndef TRISOUP_ARGS_BIN_H
#define TRISOUP_ARGS_BIN_H
#include "args/types.h"
#define BIN_SCAN_TILES 2048u  // of a workgroup of bin_scan
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Which triangles a tile of 8 x 8 pixels may show: count, then offsets, then lists. Of `tiles` tiles from tile_first
/// on: a band.
struct BinArgs {
  POINTER(Views) views;
  POINTER(ScreenTriangles) screen;
  POINTER(Uints) counts;   // [all tiles]: triangles of a tile, counted down to 0 by the fill
  POINTER(Uints) offsets;  // [all tiles + 1], into the lists of the band
  POINTER(Uints) lists;    // [capacity]
  POINTER(Controls) control;
  POINTER(Steps) state;
  uint triangles, view_count, tile_first, tiles, capacity, pad;
};

#ifndef GL_core_profile
}
#endif
#endif
