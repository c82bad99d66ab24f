// Arguments of compare_features.comp.
#ifndef TRISOUP_ARGS_COMPARE_FEATURES_H
#define TRISOUP_ARGS_COMPARE_FEATURES_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Weighted squared distance of the unit feature vectors of two pictures. One thread per pixel.
struct CompareFeaturesArgs {
  POINTER(Floats) first, second;  // [channels][pixels]
  POINTER(Floats) weights;        // [channels]
  POINTER(Uints) sums;      // added to: sum over the pixels in fixed point, in units of IMAGE_SUM_UNIT (two words)
  POINTER(Uints) overflow;  // set to 1 if a distance is not finite or too large to add
  uint pixels, channels;
};

#ifndef GL_core_profile
}
#endif
#endif
