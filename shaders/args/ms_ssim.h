// Arguments of ms_ssim.comp.
#ifndef TRISOUP_ARGS_MS_SSIM_H
#define TRISOUP_ARGS_MS_SSIM_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Sums one scale of MS-SSIM over the windows of a picture. One workgroup per block of 16 x 16 pixels.
struct MsSsimArgs {
  POINTER(Floats) colour;        // [height][width][3]
  POINTER(Uints) target;         // [height][width]: RGBA8, alpha is the loss mask; or
  POINTER(Floats) float_target;  // [height][width][3]
  POINTER(Uints) sums;           // [3], added to: of the channels, fixed point in units of IMAGE_SUM_UNIT (two words)
  uint width, height;
  uint last;  // 1: with the comparison of luminance, as the last scale; 0: contrast and structure
  uint pad;
};

#ifndef GL_core_profile
}
#endif
#endif
