// Arguments of bin.comp.
#ifndef TRISOUP_ARGS_BIN_H
#define TRISOUP_ARGS_BIN_H
#include "args/types.h"
#define BIN_SCAN_TILES 2048u  // per workgroup of bin_scan
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Lists of the triangles that may cover each tile of 8 x 8 pixels: counts, then offsets, then lists. Processes a band
/// of `tiles` tiles starting at tile_first.
struct BinArgs {
  POINTER(Views) views;
  POINTER(ScreenTriangles) screen;
  POINTER(Uints) counts;   // [all tiles]: triangles of a tile; the fill counts it down to 0
  POINTER(Uints) offsets;  // [all tiles + 1], indices into the lists of the band
  POINTER(Uints) lists;    // [capacity]
  POINTER(Controls) control;
  POINTER(Steps) state;
  uint triangles, view_count, tile_first, tiles, capacity, pad;
};

#ifndef GL_core_profile
}
#endif
#endif
