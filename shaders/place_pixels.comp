// Assigns adjacent positions to the pixels of each triangle. The order of the triangles does not matter, because sums
// over pixels do not depend on their order.
#include "common/kernel.h"
#include "args/place_pixels.h"

KERNEL(64, PlacePixelsArgs) {
  const uint triangle = thread_index();
  if (triangle >= a.triangles) return;
  const uint count = a.counts.v[triangle];
  if (count != 0u) a.counts.v[a.triangles + 1u + triangle] = atomicAdd(a.counts.v[a.triangles], count);
}
