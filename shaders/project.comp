// Clip coordinates and pixel box of every triangle in every view.
#include "common/kernel.h"
#include "args/project.h"

FN bool finite(vec4 p) { return abs(p.x) < 1e30f && abs(p.y) < 1e30f && abs(p.z) < 1e30f && abs(p.w) < 1e30f; }

KERNEL(64, ProjectArgs) {
  const uint i = thread_index();
  if (i >= a.triangles * a.view_count) return;
  const uint view = i / a.triangles, triangle = i % a.triangles;
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
  s.pad0 = s.pad1 = 0u;

  bool seen = finite(p[0]) && finite(p[1]) && finite(p[2]);
  // As published: a triangle that reaches the camera plane is dropped whole.
  seen = seen && p[0].w > 0.0f && p[1].w > 0.0f && p[2].w > 0.0f;
  seen = seen && !(p[0].z > p[0].w && p[1].z > p[1].w && p[2].z > p[2].w);
  seen = seen && !(p[0].z < -p[0].w && p[1].z < -p[1].w && p[2].z < -p[2].w);
  if (seen) {
    const vec3 a0 = vec3(p[0]) / p[0].w, a1 = vec3(p[1]) / p[1].w, a2 = vec3(p[2]) / p[2].w;
    const vec2 size = vec2(a.views.v[view].width, a.views.v[view].height);
    const vec2 low = (vec2(min(a0, min(a1, a2))) + 1.0f) * 0.5f * size - 0.5f;
    const vec2 high = (vec2(max(a0, max(a1, a2))) + 1.0f) * 0.5f * size - 0.5f;
    // Pixels whose centres may be covered; the margin is for rounding.
    const ivec2 first = ivec2(ceil(clamp(low - 0.02f, vec2(0.0f), size)));
    const ivec2 last = ivec2(floor(clamp(high + 0.02f, vec2(-1.0f), size - 1.0f)));
    if (first.x <= last.x && first.y <= last.y) {
      s.box_min = uint(first.x) | (uint(first.y) << 16);
      s.box_max = uint(last.x) | (uint(last.y) << 16);
    }
  }
  a.screen.v[i] = s;
}
