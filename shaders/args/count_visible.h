// Arguments of count_visible.comp.
#ifndef TRISOUP_ARGS_COUNT_VISIBLE_H
#define TRISOUP_ARGS_COUNT_VISIBLE_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Pixels that each triangle wins. One thread per pixel.
struct CountVisibleArgs {
  POINTER(Hits) hits;
  POINTER(Uints) counts;  // [T], added to
  POINTER(Uints) ranks;   // [pixels] where asked for: 0 to counts - 1, of those in which something is visible
  uint pixels, pad;
};

#ifndef GL_core_profile
}
#endif
#endif
