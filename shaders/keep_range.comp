// Limits the tiles' lists to a range of triangles. The others keep their clip coordinates, which edge forces need.
#include "common/kernel.h"
#include "args/keep_range.h"

KERNEL(64, KeepRangeArgs) {
  const uint i = thread_index();
  if (i >= a.triangles * a.view_count) return;
  const uint triangle = i % a.triangles;
  if (triangle >= a.first && triangle < a.last) return;
  a.screen.v[i].box_min = 0xffffffffu;
  a.screen.v[i].box_max = 0u;
}
