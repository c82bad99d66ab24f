// Arguments of collect_pairs.comp.
#ifndef TRISOUP_ARGS_COLLECT_PAIRS_H
#define TRISOUP_ARGS_COLLECT_PAIRS_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Collects the distinct pairs of a triangle and the triangle that a pixel shows without it. One thread per pixel.
struct CollectPairsArgs {
  POINTER(Hits) first;   // [pixels] with the triangle
  POINTER(Hits) behind;  // [pixels] without the triangle
  POINTER(Uints) table;  // [slots], initially 0: 1 + a pixel that shows the pair of this slot
  // [1 + 2 capacity]: number of pairs (above the capacity if they did not fit), then the pairs, in any order
  POINTER(Uints) found;
  uint pixels, slots, capacity, pad;  // slots: a power of two
};

#ifndef GL_core_profile
}
#endif
#endif
