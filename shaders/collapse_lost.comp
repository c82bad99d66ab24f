// Collapses triangles with a non-finite vertex (common/non_finite.h) to a point. They have no area, are never visible,
// and the next refinement that drops invisible triangles removes them.
#include "common/kernel.h"
#include "args/collapse_lost.h"
#include "common/non_finite.h"

KERNEL(64, CollapseLostArgs) {
  const uint triangle = thread_index();
  if (triangle >= a.triangles) return;
  vec3 point = vec3(0.0f);
  bool lost = false;
  for (uint k = 3u; k > 0u; --k) {
    const uint at = triangle * 9u + 3u * (k - 1u);
    const vec3 p = vec3(a.vertices.v[at], a.vertices.v[at + 1u], a.vertices.v[at + 2u]);
    if (usable(p, kLargestCoordinate))
      point = p;
    else
      lost = true;
  }
  if (!lost) return;
  for (uint i = 0u; i < 9u; ++i) {
    a.vertices.v[triangle * 9u + i] = point[i % 3u];
    a.moment1.v[triangle * 9u + i] = 0.0f;
  }
  for (uint k = 0u; k < 3u; ++k) a.moment2.v[triangle * 3u + k] = 0.0f;
  atomicAdd(a.collapsed.v[0], 1u);
}
