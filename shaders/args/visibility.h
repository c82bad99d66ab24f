// Arguments of visibility.comp.
#ifndef TRISOUP_ARGS_VISIBILITY_H
#define TRISOUP_ARGS_VISIBILITY_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Finds the nearest fragment of every pixel whose opacity reaches its threshold, or another one depending on LAYER
/// (visibility.comp). One workgroup per tile of a band.
struct VisibilityArgs {
  POINTER(Views) views;
  POINTER(ScreenTriangles) screen;
  POINTER(Uints) offsets;
  POINTER(Uints) lists;
  POINTER(Textures) textures;
  POINTER(Floats) opacity;     // [lattice samples], after the sigmoid
  POINTER(Floats) thresholds;  // [pixels][T], if thresholds are given
  POINTER(Hits) first;         // [pixels]: visible triangles, if the ones behind them are requested
  POINTER(Steps) state;
  POINTER(Hits) hits;
  uint triangles, view_count, tile_first, tiles, capacity, pad;
};

#ifndef GL_core_profile
}
#endif
#endif
