// Counts holes opened by hiding triangles: pixels that showed a hidden triangle and now show the backdrop or nothing.
#include "common/kernel.h"
#include "args/count_holes.h"

KERNEL(64, CountHolesArgs) {
  const uint i = thread_index();
  if (i >= a.pixels) return;
  const uint first = a.first.v[i].triangle, without = a.without.v[i].triangle;
  if (first == 0u) return;
  if ((a.flags.v[first - 1u] & 1u) == 0u) return;
  bool open = without == 0u;
  if (!open) open = (a.flags.v[without - 1u] & 2u) != 0u;
  if (open) atomicAdd(a.counts.v[first - 1u], 1u);
}
