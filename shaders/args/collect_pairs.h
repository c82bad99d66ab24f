// Arguments of collect_pairs.comp.
#ifndef TRISOUP_ARGS_COLLECT_PAIRS_H
#define TRISOUP_ARGS_COLLECT_PAIRS_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Pairs of a triangle and the one that a pixel shows without it, each once. One thread per pixel.
struct CollectPairsArgs {
  POINTER(Hits) first;   // [pixels] with it
  POINTER(Hits) behind;  // [pixels] without it
  POINTER(Uints) table;  // [slots], 0 before: 1 + a pixel that shows the pair in this slot
  POINTER(Uints)
  found;  // [1 + 2 capacity]: how many pairs, above the capacity where they did not fit; the pairs, in any order
  uint pixels, slots, capacity, pad;  // slots: a power of two
};

#ifndef GL_core_profile
}
#endif
#endif
