// Applies VectorAdam to every vertex.
#include "common/kernel.h"
#include "args/update_vertices.h"
#include "common/non_finite.h"
#include "common/fixed_point.h"
#include "common/optimiser.h"

CONSTANT(0, bool, DEBUG, false);

KERNEL(64, UpdateVerticesArgs) {
  const uint vertex = thread_index();
  if (vertex >= a.vertex_count) return;
  vec3 gradient, m, p;
  UNROLL for (uint i = 0u; i < 3u; ++i) {
    const uint at = vertex * 3u + i;
    gradient[i] = from_fixed(a.gradient_low.v[at], a.gradient_high.v[at]);
    a.gradient_low.v[at] = kFixedZero;
    a.gradient_high.v[at] = 0u;
    m[i] = a.moment1.v[at];
    p[i] = a.vertices.v[at];
    if (DEBUG) a.debug.v[at] = gradient[i];
  }
  if (a.control.v[0].overflow != 0u) return;
  float v = a.moment2.v[vertex];
  const vec3 before = p;
  p -= vector_adam(gradient, a.state.v[0].lr_vertex, a.state.v[0].second_vertex, m, v);
  if (!usable(p, kLargestCoordinate) || !usable(m, 1e30f) || !usable(v, 1e30f)) {
    // A valid vertex keeps its position. A non-finite vertex is skipped by all renderers until the host collapses its
    // triangle (collapse_lost.comp); this thread must not write the other two vertices.
    p = before;
    m = vec3(0.0f);
    v = 0.0f;
    note_non_finite(a.control, NON_FINITE_VERTEX, vertex * 3u, a.state.v[0].step);
  }
  a.moment2.v[vertex] = v;
  UNROLL for (uint i = 0u; i < 3u; ++i) {
    a.moment1.v[vertex * 3u + i] = m[i];
    a.vertices.v[vertex * 3u + i] = p[i];
  }
}
