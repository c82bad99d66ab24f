// Arguments of place_pixels.comp.
#ifndef TRISOUP_ARGS_PLACE_PIXELS_H
#define TRISOUP_ARGS_PLACE_PIXELS_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Where the gradients of each triangle's pixels go. One thread per triangle.
struct PlacePixelsArgs {
  POINTER(Uints) counts;  // [triangles] pixels, one word that is 0 before, [triangles] places
  uint triangles, pad;
};

#ifndef GL_core_profile
}
#endif
#endif
