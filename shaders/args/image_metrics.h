// Arguments of image_metrics.comp.
#ifndef TRISOUP_ARGS_IMAGE_METRICS_H
#define TRISOUP_ARGS_IMAGE_METRICS_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Sums over each view for PSNR, SSIM, MAE and coverage. One workgroup per block of 16 x 16 pixels.
struct ImageMetricsArgs {
  POINTER(Views) views;
  POINTER(Hits) hits;
  POINTER(Floats) colour;        // [pixels][3]
  POINTER(Uints) target;         // [pixels]: RGBA8, alpha is the loss mask
  POINTER(Floats) float_target;  // not read
  POINTER(Uints) sums;           // [views] ImageSums, added to
  uint view_count, blocks;
  float background_r, background_g, background_b;
  uint pad;
};

#ifndef GL_core_profile
}
#endif
#endif
