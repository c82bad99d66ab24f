// Arguments of max_pool.comp.
#ifndef TRISOUP_ARGS_MAX_POOL_H
#define TRISOUP_ARGS_MAX_POOL_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Maxima of squares of `size` values. One thread per value of the result.
struct MaxPoolArgs {
  POINTER(Floats) from;    // [channels][height][width]
  POINTER(Floats) result;  // [channels][result_height][result_width]
  uint width, height;
  uint result_width, result_height;
  uint values;  // of the result
  uint size, stride, pad;
};

#ifndef GL_core_profile
}
#endif
#endif
