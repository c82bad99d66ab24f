// Arguments of view_depths.comp.
#ifndef TRISOUP_ARGS_VIEW_DEPTHS_H
#define TRISOUP_ARGS_VIEW_DEPTHS_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Depth of what each pixel shows. One workgroup per block of 16 x 16 pixels.
struct ViewDepthsArgs {
  POINTER(Views) views;
  POINTER(Hits) hits;
  POINTER(Floats) vertices;  // [T][3][3]
  POINTER(Uints) masks;      // [pixels]: RGBA8, alpha is the loss mask
  POINTER(Floats) depths;    // [pixels]: along the viewing direction; kNothingShown: no triangle; 0: masked out
  uint view_count, blocks;
};

#ifndef GL_core_profile
}
#endif
#endif
