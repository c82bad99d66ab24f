// First planes of PatchMatch stereo: random ones, or those of a coarser level.
#include "common/kernel.h"
#include "args/patch_match.h"
#include "common/patch_match.h"
#include "common/random.h"

KERNEL(64, PatchMatchArgs) {
  const uint pixel = thread_index();
  if (pixel >= a.width * a.height) return;
  vec4 plane = vec4(0.0f, 0.0f, 0.0f, kNoMatch);
  if (a.coarse_width == 0u) {
    plane.x = a.nearest * threshold_of(threshold_pixel(a.key, pixel), 0u);
  } else {
    const float scale_x = float(a.coarse_width) / float(a.width), scale_y = float(a.coarse_height) / float(a.height);
    const float x = (float(pixel % a.width) + 0.5f) * scale_x - 0.5f;
    const float y = (float(pixel / a.width) + 0.5f) * scale_y - 0.5f;
    const float i = clamp(floor(x + 0.5f), 0.0f, float(a.coarse_width) - 1.0f);
    const float j = clamp(floor(y + 0.5f), 0.0f, float(a.coarse_height) - 1.0f);
    const vec4 coarse = a.before.v[a.coarse_offset + uint(j) * a.coarse_width + uint(i)];
    const vec3 moved = plane_moved(vec3(coarse.x, coarse.y, coarse.z), x - i, y - j);
    plane = vec4(clamp(moved.x, 0.0f, a.nearest), scale_x * moved.y, scale_y * moved.z, kNoMatch);
  }
  a.planes.v[a.pixel_offset + pixel] = plane;
}
