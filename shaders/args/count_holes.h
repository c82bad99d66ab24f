// Arguments of count_holes.comp.
#ifndef TRISOUP_ARGS_COUNT_HOLES_H
#define TRISOUP_ARGS_COUNT_HOLES_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Counts the pixels where a hidden triangle covers a hole. One thread per pixel.
struct CountHolesArgs {
  POINTER(Hits) first;    // [pixels] with all triangles
  POINTER(Hits) without;  // [pixels] without the hidden triangles
  POINTER(Uints) flags;   // [T]: bit 0: hidden, bit 1: part of the backdrop
  POINTER(Uints) counts;  // [T], added to: pixels of a hidden triangle that show the backdrop or nothing without it
  uint pixels, pad;
};

#ifndef GL_core_profile
}
#endif
#endif
