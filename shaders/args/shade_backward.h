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
  POINTER(Uints) places;        // [triangles], of the first pixel of each (place_pixels)
  POINTER(Uints) ranks;         // [pixels]: of those of its triangle (count_visible)
  POINTER(Floats) sorted;       // [9][pixels]: dL/dfeature and barycentrics, by place
  POINTER(Floats) mlp_partial;  // [groups][595]
  POINTER(Floats) debug;        // [pixels][7]: dL/dfeature where asked for
  POINTER(Uints) target;        // [pixels]: RGBA8
  POINTER(Float4s) exposure;    // [photographs][2]
  uint blocks, groups, view_count;
  uint exposed;  // 1: the gradient is by colours that expose has changed; needs the two above
  uint pixels, pad;
};

#ifndef GL_core_profile
}
#endif
#endif
