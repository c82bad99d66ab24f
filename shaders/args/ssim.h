// Arguments of ssim.comp.
#ifndef TRISOUP_ARGS_SSIM_H
#define TRISOUP_ARGS_SSIM_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// SSIM of every window and its derivatives. Each workgroup processes every groups-th block of 16 x 16 windows.
struct SsimArgs {
  POINTER(Views) views;
  POINTER(Floats) colour;
  POINTER(Uints) target;         // [pixels]: RGBA8, alpha is the loss mask
  POINTER(Floats) float_target;  // [pixels][3], if the target is given in float
  POINTER(Floats) partial;       // [3 channels][d_x, d_xx, d_xy][pixels], stored at the window's first pixel
  POINTER(Uints) same;           // [blocks]: 1 if rendering and target are equal in all windows of the block
  POINTER(Steps) state;
  POINTER(Uints) statistics;  // rows of Statistics, eight words each
  uint view_count, blocks, pixels, groups;
};

#ifndef GL_core_profile
}
#endif
#endif
