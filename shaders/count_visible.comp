// How many pixels each triangle wins.
#include "common/kernel.h"
#include "args/count_visible.h"

KERNEL(64, CountVisibleArgs) {
  const uint i = thread_index();
  if (i >= a.pixels) return;
  const uint triangle = a.hits.v[i].triangle;
  if (triangle != 0u) atomicAdd(a.counts.v[triangle - 1u], 1u);
}
