// Arguments of place_pixels.comp.
#ifndef TRISOUP_ARGS_PLACE_PIXELS_H
#define TRISOUP_ARGS_PLACE_PIXELS_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Assigns positions to the gradients of each triangle's pixels. One thread per triangle.
struct PlacePixelsArgs {
  POINTER(Uints) counts;  // [triangles] pixels, one word that is initially 0, [triangles] positions
  uint triangles, pad;
};

#ifndef GL_core_profile
}
#endif
#endif
