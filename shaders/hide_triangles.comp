// Removes hidden triangles from the tiles' lists.
#include "common/kernel.h"
#include "args/hide_triangles.h"

KERNEL(64, HideTrianglesArgs) {
  const uint i = thread_index();
  if (i >= a.triangles * a.view_count) return;
  if ((a.flags.v[i % a.triangles] & 1u) == 0u) return;
  a.screen.v[i].box_min = 0xffffffffu;
  a.screen.v[i].box_max = 0u;
}
