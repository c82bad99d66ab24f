// Arguments of shade_backward.comp.
#ifndef TRISOUP_ARGS_SHADE_BACKWARD_H
#define TRISOUP_ARGS_SHADE_BACKWARD_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Gradients of the features, sorted by triangle, and of the MLP, summed per workgroup in registers.
struct ShadeBackwardArgs {
  POINTER(Views) views;
  POINTER(Hits) hits;
  POINTER(Textures) textures;
  POINTER(Float4s) lattice;
  POINTER(Floats) mlp;
  POINTER(Float4s) gradient;
  POINTER(Uints) places;        // [triangles]: position of the first pixel of each (place_pixels)
  POINTER(Uints) ranks;         // [pixels]: rank among the pixels of its triangle (count_visible)
  POINTER(Floats) sorted;       // [9][pixels]: dL/dfeature and barycentrics, by position
  POINTER(Floats) mlp_partial;  // [groups][MLP_COUNT]
  POINTER(Floats) debug;        // [pixels][7]: dL/dfeature, if requested
  POINTER(Float4s) exposure;    // [photographs][25]
  uint blocks, groups, view_count;
  uint exposed;  // 1: the gradient is with respect to colours changed by expose; needs exposure
  uint pixels, pad;
};

#ifndef GL_core_profile
}
#endif
#endif
