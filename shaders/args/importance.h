// Arguments of importance.comp.
#ifndef TRISOUP_ARGS_IMPORTANCE_H
#define TRISOUP_ARGS_IMPORTANCE_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Sums weighted errors of a rendering per triangle that the first rendering shows. One workgroup per block of 16 x 16
/// pixels.
struct ImportanceArgs {
  POINTER(Views) views;
  POINTER(Hits) first;       // [pixels]: visible triangles of the first rendering
  POINTER(Floats) colour;    // [pixels][3] of this rendering
  POINTER(Uints) target;     // [pixels]: RGBA8
  POINTER(Floats) flatness;  // [pixels], from contrast.comp
  POINTER(Uints) contrast;   // [views][4], from contrast.comp
  POINTER(Floats) errors;    // [pixels]: written by the first rendering, subtracted from the others
  POINTER(Uints) low;        // [T + 1] fixed point: per triangle; [T]: all pixels of the first rendering
  POINTER(Uints) high;
  POINTER(Uints) pixels;  // [T], added to: pixels that show the triangle in the first rendering
  uint view_count, blocks, triangles;
  float unit;  // unit of the sums: a power of two
};

#ifndef GL_core_profile
}
#endif
#endif
