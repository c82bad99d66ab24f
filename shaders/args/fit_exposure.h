// Arguments of fit_exposure.comp.
#ifndef TRISOUP_ARGS_FIT_EXPOSURE_H
#define TRISOUP_ARGS_FIT_EXPOSURE_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Exposures of a batch's photographs. One workgroup.
struct FitExposureArgs {
  POINTER(Views) views;
  POINTER(Uints) sums_low;  // [views of the batch][4][4], from measure_exposure; empty again afterwards
  POINTER(Uints) sums_high;
  POINTER(Float4s) fitted;    // [photographs][2]: against the scene's colours as they are
  POINTER(Float4s) exposure;  // [photographs][2]: what is believed of it beyond the mean of all
  POINTER(Controls) control;
  uint view_count, photographs;
};

#ifndef GL_core_profile
}
#endif
#endif
