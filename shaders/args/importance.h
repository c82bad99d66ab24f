// Arguments of importance.comp.
#ifndef TRISOUP_ARGS_IMPORTANCE_H
#define TRISOUP_ARGS_IMPORTANCE_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Weighted errors of a rendering, by the triangle that the first rendering shows. One workgroup per block of 16 x 16
/// pixels.
struct ImportanceArgs {
  POINTER(Views) views;
  POINTER(Hits) first;       // [pixels]: what the first rendering shows
  POINTER(Floats) colour;    // [pixels][3] of this rendering
  POINTER(Uints) target;     // [pixels]: RGBA8
  POINTER(Floats) flatness;  // [pixels], as contrast.comp leaves them
  POINTER(Uints) contrast;   // [views][4], as well
  POINTER(Floats) errors;    // [pixels] of the first rendering: written by it, subtracted from the others
  POINTER(Uints) low;        // [T + 1] fixed point: by triangle and, of the first rendering, all pixels' at T
  POINTER(Uints) high;
  POINTER(Uints) pixels;  // [T]: of the first rendering, how many show the triangle; added to
  uint view_count, blocks, triangles;
  float unit;  // of the sums: a power of two
};

#ifndef GL_core_profile
}
#endif
#endif
