// Arguments of sort_gradients.comp.
#ifndef TRISOUP_ARGS_SORT_GRADIENTS_H
#define TRISOUP_ARGS_SORT_GRADIENTS_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Moves the feature gradients of pixels to the positions of their triangles, for triangles first .. last - 1. One
/// thread per pixel.
struct SortGradientsArgs {
  POINTER(Hits) hits;
  POINTER(Uints) places;     // [triangles]: position of the first pixel of each (place_pixels)
  POINTER(Uints) ranks;      // [pixels]: rank among the pixels of its triangle (count_visible)
  POINTER(Floats) gradient;  // [7][pixels]
  POINTER(Floats) sorted;    // [9][pixels]: dL/dfeature and barycentrics, by position
  uint pixels, first, last, pad;
};

#ifndef GL_core_profile
}
#endif
#endif
