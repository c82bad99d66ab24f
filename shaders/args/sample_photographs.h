// Arguments of sample_photographs.comp.
#ifndef TRISOUP_ARGS_SAMPLE_PHOTOGRAPHS_H
#define TRISOUP_ARGS_SAMPLE_PHOTOGRAPHS_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Resamples the photographs of a batch at the positions where the batch samples them. One workgroup per block of 16 x
/// 16 pixels.
struct SamplePhotographsArgs {
  POINTER(Views) views;
  POINTER(Uints) target;  // [pixels]: RGBA8, alpha is the loss mask
  uint blocks, view_count;
};

#ifndef GL_core_profile
}
#endif
#endif
