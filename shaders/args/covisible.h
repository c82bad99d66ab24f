// Arguments of covisible.comp.
#ifndef TRISOUP_ARGS_COVISIBLE_H
#define TRISOUP_ARGS_COVISIBLE_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Masks out the pixels that fewer than two witnesses, other views, show unhidden. One workgroup per block of 16 x 16
/// pixels.
struct CovisibleArgs {
  POINTER(Views) views;
  POINTER(Hits) hits;
  POINTER(Floats) vertices;   // [T][3][3]
  POINTER(Uints) target;      // [pixels]: RGBA8; alpha, the loss mask, becomes 0
  POINTER(Views) witnesses;   // pixel_offset: index of the first pixel in `depths`
  POINTER(Floats) depths;     // from view_depths.comp
  POINTER(Uints) candidates;  // [views][list_length]: number of witnesses, their indices
  uint view_count, blocks, list_length, pad;
};

#ifndef GL_core_profile
}
#endif
#endif
