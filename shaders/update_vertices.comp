// Applies VectorAdam to every vertex.
#include "common/kernel.h"
#include "args/update_vertices.h"
#include "common/non_finite.h"
#include "common/fixed_point.h"
#include "common/optimiser.h"

CONSTANT(0, bool, DEBUG, false);

ARGUMENTS(UpdateVerticesArgs)

/// Factor of the learning rate: the side of an equilateral triangle of the same area as a share of `full_side`, at most
/// 1. A step that suits a wall across the room would tear the small triangles of what stands in front.
FN float size_factor(TAKES_ARGUMENTS uint triangle) {
  if (!(a.full_side > 0.0f)) return 1.0f;
  vec3 p[3];
  UNROLL for (uint k = 0u; k < 3u; ++k) {
    const uint at = triangle * 9u + k * 3u;
    p[k] = vec3(a.vertices.v[at], a.vertices.v[at + 1u], a.vertices.v[at + 2u]);
  }
  const vec3 e = p[1] - p[0], f = p[2] - p[0];
  const vec3 normal = vec3(e.y * f.z - e.z * f.y, e.z * f.x - e.x * f.z, e.x * f.y - e.y * f.x);
  const float side = sqrt(1.1547f * sqrt(dot(normal, normal)));  // area: sqrt(3) / 4 side^2
  return min(side / a.full_side, 1.0f);
}

/// Factor of the learning rate: the distance to the nearest camera as a share of `full_distance`, at most 1. A step
/// that suits what stands across the room would move what is near over half the picture, or over a camera.
FN float distance_factor(TAKES_ARGUMENTS vec3 p) {
  if (a.eye_count == 0u) return 1.0f;
  float nearest = a.full_distance * a.full_distance;
  for (uint i = 0u; i < a.eye_count; ++i) {
    const vec3 d = p - vec3(a.eyes.v[3u * i], a.eyes.v[3u * i + 1u], a.eyes.v[3u * i + 2u]);
    nearest = min(nearest, dot(d, d));
  }
  return sqrt(nearest) / a.full_distance;
}

FN void update(TAKES_ARGUMENTS uint vertex, float factor) {
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
  factor *= distance_factor(GIVES_ARGUMENTS p);
  if (a.still_beyond > 0.0f && dot(p, p) > a.still_beyond * a.still_beyond) factor = 0.0f;
  p -= vector_adam(gradient, factor * a.state.v[0].lr_vertex, a.state.v[0].second_vertex, m, v);
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

KERNEL_MAIN(64) {
  const uint triangle = thread_index();
  if (triangle >= a.triangles) return;
  const float factor = size_factor(GIVES_ARGUMENTS triangle);
  for (uint k = 0u; k < 3u; ++k) update(GIVES_ARGUMENTS 3u * triangle + k, factor);
}
