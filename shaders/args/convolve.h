// Arguments of convolve.comp.
#ifndef TRISOUP_ARGS_CONVOLVE_H
#define TRISOUP_ARGS_CONVOLVE_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Convolution with zeros beyond the edges, and ReLU: CONVOLVE_CHANNELS channels of the result. One workgroup per 64
/// values of a row.
struct ConvolveArgs {
  POINTER(Floats) from;      // [channels][height][width]
  POINTER(Float4s) weights;  // [channels][size][size][CONVOLVE_CHANNELS]
  POINTER(Float4s) bias;     // [CONVOLVE_CHANNELS]
  POINTER(Floats) result;    // [CONVOLVE_CHANNELS][result_height][result_width]
  POINTER(Uints) overflow;   // set to 1 if a value is not finite
  uint channels, width, height;
  uint result_width, result_height;
  uint result_channels;  // to write, at most CONVOLVE_CHANNELS
  uint size, stride, padding;
  uint pad;
};
#define CONVOLVE_CHANNELS 16

#ifndef GL_core_profile
}
#endif
#endif
