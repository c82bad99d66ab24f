// Clip coordinates and pixel box of every triangle in every view. Triangles are not clipped: visibility rejects
// fragments closer than the near plane (common/coverage.h). Only the box is limited to the part beyond it.
#include "common/kernel.h"
#include "args/project.h"
#include "common/non_finite.h"

FN bool usable(vec4 p) { return usable(vec3(p), kLargestCoordinate) && usable(p.w, kLargestCoordinate); }

/// Extends a box of NDC coordinates by a point. error: bound of the rounding error of each of its coordinates.
FN void extend(vec4 p, float error, INOUT(vec2) low, INOUT(vec2) high) {
  if (!(p.w > 2.0f * error)) {
    low = vec2(-1e9f);
    high = vec2(1e9f);
    return;
  }
  const vec2 at = vec2(p) / p.w;
  const vec2 slack = error * (1.0f + abs(at)) / (p.w - error);
  low = min(low, at - slack);
  high = max(high, at + slack);
}

KERNEL(64, ProjectArgs) {
  // A group belongs to one view.
  const uint groups = (a.triangles + 63u) / 64u;
  const uint view = group_index() / groups, triangle = group_index() % groups * 64u + gl_LocalInvocationIndex;
  if (view >= a.view_count || triangle >= a.triangles) return;
  const uint i = view * a.triangles + triangle;
  const mat4 m = a.views.v[view].clip_from_world;

  vec4 p[3];
  UNROLL for (int k = 0; k < 3; ++k) {
    const uint at = triangle * 9u + 3u * k;
    p[k] = m * vec4(a.vertices.v[at], a.vertices.v[at + 1u], a.vertices.v[at + 2u], 1.0f);
  }

  ScreenTriangle s;
  s.p0 = p[0];
  s.p1 = p[1];
  s.p2 = p[2];
  s.box_min = 0xffffffffu;
  s.box_max = 0u;
  s.crosses = s.pad0 = 0u;

  bool seen = usable(p[0]) && usable(p[1]) && usable(p[2]);
  if (a.drop_near != 0u) seen = seen && p[0].w > 0.0f && p[1].w > 0.0f && p[2].w > 0.0f;
  seen = seen && !(p[0].z > p[0].w && p[1].z > p[1].w && p[2].z > p[2].w);
  // Positive beyond the near plane. Points behind the camera are on its other side as well.
  const float above[3] = {p[0].z + p[0].w, p[1].z + p[1].w, p[2].z + p[2].w};
  seen = seen && !(above[0] < 0.0f && above[1] < 0.0f && above[2] < 0.0f);
  if (seen) {
    vec2 ndc_low = vec2(1e9f), ndc_high = vec2(-1e9f);
    const bool before = min(above[0], min(above[1], above[2])) >= 0.0f && min(p[0].w, min(p[1].w, p[2].w)) > 0.0f;
    if (a.drop_near == 0u && !before) {
      s.crosses = 1u;
      // The corners of the remaining polygon, up to four.
      UNROLL for (int k = 0; k < 3; ++k) {
        const int n = k < 2 ? k + 1 : 0;
        if (above[k] >= 0.0f) extend(p[k], 0.0f, ndc_low, ndc_high);
        if ((above[k] >= 0.0f) == (above[n] >= 0.0f)) continue;
        const float t = above[k] / (above[k] - above[n]);
        const vec4 sizes = abs(p[k]) + abs(p[n]);
        extend(p[k] + t * (p[n] - p[k]), 5e-7f * (sizes.x + sizes.y + sizes.z + sizes.w), ndc_low, ndc_high);
      }
    } else {
      const vec2 a0 = vec2(p[0]) / p[0].w, a1 = vec2(p[1]) / p[1].w, a2 = vec2(p[2]) / p[2].w;
      ndc_low = min(a0, min(a1, a2));
      ndc_high = max(a0, max(a1, a2));
    }
    const vec2 size = vec2(a.views.v[view].width, a.views.v[view].height);
    const vec2 low = (ndc_low + 1.0f) * 0.5f * size - 0.5f, high = (ndc_high + 1.0f) * 0.5f * size - 0.5f;
    // Pixels whose centres may be covered, with a margin for rounding.
    const ivec2 first = ivec2(ceil(clamp(low - 0.02f, vec2(0.0f), size)));
    const ivec2 last = ivec2(floor(clamp(high + 0.02f, vec2(-1.0f), size - 1.0f)));
    if (first.x <= last.x && first.y <= last.y) {
      s.box_min = uint(first.x) | (uint(first.y) << 16);
      s.box_max = uint(last.x) | (uint(last.y) << 16);
    }
  }
  a.screen.v[i] = s;
}
