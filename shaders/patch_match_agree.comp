// Which neighbours of a view have a plane at the same place as each of its pixels.
#include "common/kernel.h"
#include "args/patch_match.h"
#include "common/patch_match.h"

ARGUMENTS(PatchMatchArgs)

const float kSamePixel = 1.0f;   // largest distance of the way there and back, pixels
const float kSameDepth = 0.02f;  // largest relative difference of depths

FN bool agrees(TAKES_ARGUMENTS uint pair, float x, float y, float w) {
  const vec3 q = transferred(a.pairs.v[pair].to_x, a.pairs.v[pair].to_y, a.pairs.v[pair].to_z, x, y, w);
  if (!(q.z > 1e-6f)) return false;
  const float u = q.x / q.z, v = q.y / q.z;
  const int i = int(floor(u + 0.5f)), j = int(floor(v + 0.5f));
  if (i < 0 || j < 0 || i >= int(a.pairs.v[pair].width) || j >= int(a.pairs.v[pair].height)) return false;
  const vec4 other = a.before.v[a.pairs.v[pair].pixel_offset + uint(j) * a.pairs.v[pair].width + uint(i)];
  if (other.w > a.largest_cost) return false;
  const float there = other.x + other.y * (u - float(i)) + other.z * (v - float(j));
  const vec3 back = transferred(a.pairs.v[pair].from_x, a.pairs.v[pair].from_y, a.pairs.v[pair].from_z, u, v, there);
  if (!(back.z > 1e-6f)) return false;
  const float dx = back.x / back.z - x, dy = back.y / back.z - y, again = there / back.z;
  return dx * dx + dy * dy <= kSamePixel * kSamePixel && abs(again - w) <= kSameDepth * max(again, w) + a.pixel_step;
}

KERNEL_MAIN(64) {
  const uint pixel = thread_index();
  if (pixel >= a.width * a.height) return;
  const uint at = a.pixel_offset + pixel;
  const vec4 plane = a.planes.v[at];
  uint bits = 0u;
  if (plane.w <= a.largest_cost)
    for (uint k = 0u; k < a.pair_count; ++k)
      if (agrees(GIVES_ARGUMENTS a.first_pair + k, float(pixel % a.width), float(pixel / a.width), plane.x))
        bits |= 1u << k;
  a.agreeing.v[at] = bits;
}
