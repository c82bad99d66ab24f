// Arguments of sort_gradients.comp.
#ifndef TRISOUP_ARGS_SORT_GRADIENTS_H
#define TRISOUP_ARGS_SORT_GRADIENTS_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Feature gradients of pixels to the places of their triangles, for triangles first .. last - 1. One thread per pixel.
struct SortGradientsArgs {
  POINTER(Hits) hits;
  POINTER(Uints) places;     // [triangles], of the first pixel of each (place_pixels)
  POINTER(Uints) ranks;      // [pixels]: of those of its triangle (count_visible)
  POINTER(Floats) gradient;  // [7][pixels]
  POINTER(Floats) sorted;    // [9][pixels]: dL/dfeature and barycentrics, by place
  uint pixels, first, last, pad;
};

#ifndef GL_core_profile
}
#endif
#endif
