// Arguments of loss_gradient.comp.
#ifndef TRISOUP_ARGS_LOSS_GRADIENT_H
#define TRISOUP_ARGS_LOSS_GRADIENT_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// dL/dC of every pixel from L1 and SSIM. Each workgroup processes every groups-th block of 16 x 16 pixels.
struct LossGradientArgs {
  POINTER(Views) views;
  POINTER(Floats) colour;
  POINTER(Uints) target;
  POINTER(Floats) float_target;
  POINTER(Floats) partial;
  POINTER(Uints) same;        // [blocks], from ssim
  POINTER(Float4s) gradient;  // [pixels]: dL/dC, and sum_c |C - target|, or -1 if masked out
  POINTER(Steps) state;
  POINTER(Uints) statistics;  // rows of Statistics, eight words each
  uint view_count, blocks, pixels, groups;
};

#ifndef GL_core_profile
}
#endif
#endif
