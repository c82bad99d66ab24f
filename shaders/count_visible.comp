// Counts the pixels that show each triangle.
#include "common/kernel.h"
#include "args/count_visible.h"

CONSTANT(0, bool, RANKS, false);  // also number the pixels of each triangle, in any order

KERNEL(64, CountVisibleArgs) {
  const uint i = thread_index();
  if (i >= a.pixels) return;
  const uint triangle = a.hits.v[i].triangle;
  if (triangle == 0u) return;
  const uint rank = atomicAdd(a.counts.v[triangle - 1u], 1u);
  if (RANKS) a.ranks.v[i] = rank;
}
