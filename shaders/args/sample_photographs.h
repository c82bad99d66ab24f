// Arguments of sample_photographs.comp.
#ifndef TRISOUP_ARGS_SAMPLE_PHOTOGRAPHS_H
#define TRISOUP_ARGS_SAMPLE_PHOTOGRAPHS_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Resamples the photographs of a batch at the positions where the batch samples them, and moves those of views with a
/// background of their own to that background. One workgroup per block of 16 x 16 pixels.
struct SamplePhotographsArgs {
  POINTER(Views) views;
  POINTER(Uints) target;  // [pixels]: RGBA8, alpha is the loss mask
  uint blocks, view_count;
  uint background, pad0;  // RGBA8: on which the photographs are composited
};

#ifndef GL_core_profile
}
#endif
#endif
