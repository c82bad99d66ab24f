// Arguments of contrast.comp.
#ifndef TRISOUP_ARGS_CONTRAST_H
#define TRISOUP_ARGS_CONTRAST_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Measures how little contrast there is around each pixel of the photographs. One workgroup per block of 16 x 16
/// pixels.
struct ContrastArgs {
  POINTER(Views) views;
  POINTER(Uints) target;     // [pixels]: RGBA8, alpha is the loss mask
  POINTER(Floats) flatness;  // [pixels]: C2 / (2 variance + C2); 0 outside the mask
  // [views][4], added to: sum of flatness in fixed point, in units of 1024 (two words); pixels inside the mask; 0
  POINTER(Uints) sums;
  uint view_count, blocks;
};

#ifndef GL_core_profile
}
#endif
#endif
