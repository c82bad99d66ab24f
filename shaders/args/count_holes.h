// Arguments of count_holes.comp.
#ifndef TRISOUP_ARGS_COUNT_HOLES_H
#define TRISOUP_ARGS_COUNT_HOLES_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Pixels that hidden triangles keep shut. One thread per pixel.
struct CountHolesArgs {
  POINTER(Hits) first;    // [pixels] with all triangles
  POINTER(Hits) without;  // [pixels] without the hidden ones
  POINTER(Uints) flags;   // [T]: bit 0: hidden, bit 1: of the backdrop
  POINTER(Uints) counts;  // [T], added to: pixels that show the hidden triangle and without it the backdrop or nothing
  uint pixels, pad;
};

#ifndef GL_core_profile
}
#endif
#endif
