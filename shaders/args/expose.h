// Arguments of expose.comp.
#ifndef TRISOUP_ARGS_EXPOSE_H
#define TRISOUP_ARGS_EXPOSE_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Applies the photographs' exposures to the rendered colours in place. One workgroup per block of 16 x 16 pixels.
struct ExposeArgs {
  POINTER(Views) views;
  POINTER(Hits) hits;
  POINTER(Floats) colour;
  POINTER(Float4s) exposure;  // [photographs][25]
  uint blocks, view_count;
};

#ifndef GL_core_profile
}
#endif
#endif
