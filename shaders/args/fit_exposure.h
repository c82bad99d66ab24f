// Arguments of fit_exposure.comp.
#ifndef TRISOUP_ARGS_FIT_EXPOSURE_H
#define TRISOUP_ARGS_FIT_EXPOSURE_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Fits the exposures of a batch's photographs. One workgroup.
struct FitExposureArgs {
  POINTER(Views) views;
  POINTER(Uints) sums_low;  // [views of the batch][25][2][4], from measure_exposure; cleared afterwards
  POINTER(Uints) sums_high;
  POINTER(Float4s) start;     // [photographs][25]: before the first step
  POINTER(Float4s) fitted;    // [photographs][25]: relative to the scene's unchanged colours
  POINTER(Float4s) exposure;  // [photographs][25]: relative to the mean of all; what differs from the start is shrunk
  POINTER(Uints) cameras;     // [photographs]: which camera took it
  POINTER(Controls) control;
  uint view_count, photographs;
};

#ifndef GL_core_profile
}
#endif
#endif
