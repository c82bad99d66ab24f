// Arguments of measure_exposure.comp.
#ifndef TRISOUP_ARGS_MEASURE_EXPOSURE_H
#define TRISOUP_ARGS_MEASURE_EXPOSURE_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Sums over the pixels of a batch from which exposures are fitted. Each workgroup processes every groups-th block of
/// 16 x 16 pixels.
struct MeasureExposureArgs {
  POINTER(Views) views;
  POINTER(Hits) hits;
  POINTER(Floats) colour;
  POINTER(Uints) target;      // [pixels]: RGBA8, alpha is the loss mask
  POINTER(Float4s) exposure;  // [photographs][25]
  POINTER(Uints) sums_low;    // [views of the batch][25][2][4], fixed point: sums of common/exposure.h divided by 256
  POINTER(Uints) sums_high;
  uint blocks, view_count, groups, pad;
};

#ifndef GL_core_profile
}
#endif
#endif
