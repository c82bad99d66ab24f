// Arguments of count_visible.comp.
#ifndef TRISOUP_ARGS_COUNT_VISIBLE_H
#define TRISOUP_ARGS_COUNT_VISIBLE_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Counts the pixels that show each triangle. One thread per pixel.
struct CountVisibleArgs {
  POINTER(Hits) hits;
  POINTER(Uints) counts;  // [T], added to
  POINTER(Uints) ranks;   // [pixels], if requested: 0 to counts - 1, for pixels with a visible triangle
  uint pixels, pad;
};

#ifndef GL_core_profile
}
#endif
#endif
