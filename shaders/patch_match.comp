// One iteration of PatchMatch stereo on half of a view's pixels. A pixel tries the best planes of the other half in
// eight directions, and random changes of its own (common/patch_match.h).
#include "common/kernel.h"
#include "args/patch_match.h"
#include "common/patch_match.h"
#include "common/random.h"

ARGUMENTS(PatchMatchArgs)

const int kDirections = 8, kChanges = 4;

/// Weight of a patch's pixel that differs in brightness from the centre: it is likely to be on another surface.
FN float likeness(float difference) {
  const float d = difference * (10.0f / 255.0f);
  return 1.0f / (1.0f + d * d);
}

/// 1 - the weighted normalised cross-correlation of a patch with its image in a neighbour.
FN float match_cost(TAKES_ARGUMENTS uint pair, IN_ARRAY_OF(float, greys, 25), IN_ARRAY_OF(float, weights, 25), float x,
                    float y, vec3 plane) {
  const vec4 row_x = a.pairs.v[pair].to_x, row_y = a.pairs.v[pair].to_y, row_z = a.pairs.v[pair].to_z;
  const float last_x = float(a.pairs.v[pair].width - 1u), last_y = float(a.pairs.v[pair].height - 1u);
  const int width = int(a.pairs.v[pair].width);
  const uint offset = a.pairs.v[pair].pixel_offset;
  const vec3 centre = transferred(row_x, row_y, row_z, x, y, plane.x);
  if (!(centre.z > 1e-6f)) return kNotShown;
  const vec3 along_x = vec3(row_x.x + plane.y * row_x.w, row_y.x + plane.y * row_y.w, row_z.x + plane.y * row_z.w);
  const vec3 along_y = vec3(row_x.y + plane.z * row_x.w, row_y.y + plane.z * row_y.w, row_z.y + plane.z * row_z.w);
  float count = 0.0f, all = 0.0f, here = 0.0f, there = 0.0f, here2 = 0.0f, there2 = 0.0f, both = 0.0f;
  for (int k = 0; k < kPatchSamples; ++k) {
    const vec3 q = centre + float(patch_x(k)) * along_x + float(patch_y(k)) * along_y;
    const float inverse = 1.0f / q.z, u = q.x * inverse, v = q.y * inverse;
    all += weights[k];
    if (!(q.z > 1e-6f && u >= 0.0f && v >= 0.0f && u < last_x && v < last_y)) continue;
    const int i = int(u), j = int(v);  // equals floor, as both are positive
    const float f = u - float(i), g = v - float(j);
    const uint four = a.greys.v[offset + uint(j * width + i)];
    const float g00 = float(four & 255u), g10 = float((four >> 8) & 255u);
    const float g01 = float((four >> 16) & 255u), g11 = float(four >> 24);
    if (min(min(g00, g10), min(g01, g11)) < 0.5f) continue;
    const float upper = g00 + f * (g10 - g00), lower = g01 + f * (g11 - g01);
    // Relative to the patch's centre: rounding then matters less in the variances.
    const float t = upper + g * (lower - upper) - greys[12], s = greys[k] - greys[12], w = weights[k];
    count += w;
    here += w * s;
    there += w * t;
    here2 += w * s * s;
    there2 += w * t * t;
    both += w * s * t;
  }
  if (!(count > 0.6f * all)) return kNotShown;
  const float n = 1.0f / count;
  const float variance_here = n * (here2 - n * here * here), variance_there = n * (there2 - n * there * there);
  const float least = 1.3f;  // of a patch with contrast
  if (!(variance_here > least && variance_there > least)) return kNoMatch;
  const float covariance = n * (both - n * here * there);
  return clamp(1.0f - covariance / sqrt(variance_here * variance_there), 0.0f, kNoMatch);
}

/// How far from the pixel a point comes back that goes to the neighbour and takes its plane there; at most 3 pixels.
FN float disagreement(TAKES_ARGUMENTS uint pair, float x, float y, float w) {
  const vec3 q = transferred(a.pairs.v[pair].to_x, a.pairs.v[pair].to_y, a.pairs.v[pair].to_z, x, y, w);
  const float farthest = 3.0f;
  if (!(q.z > 1e-6f)) return farthest;
  const float u = q.x / q.z, v = q.y / q.z;
  const int i = int(floor(u + 0.5f)), j = int(floor(v + 0.5f));
  if (i < 0 || j < 0 || i >= int(a.pairs.v[pair].width) || j >= int(a.pairs.v[pair].height)) return farthest;
  const vec4 other = a.before.v[a.pairs.v[pair].pixel_offset + uint(j) * a.pairs.v[pair].width + uint(i)];
  const float there = other.x + other.y * (u - float(i)) + other.z * (v - float(j));
  const vec3 back = transferred(a.pairs.v[pair].from_x, a.pairs.v[pair].from_y, a.pairs.v[pair].from_z, u, v, there);
  if (!(back.z > 1e-6f)) return farthest;
  const float dx = back.x / back.z - x, dy = back.y / back.z - y;
  return min(sqrt(dx * dx + dy * dy), farthest);
}

FN float pair_cost(TAKES_ARGUMENTS uint pair, IN_ARRAY_OF(float, greys, 25), IN_ARRAY_OF(float, weights, 25), float x,
                   float y, vec3 plane) {
  float cost = match_cost(GIVES_ARGUMENTS pair, greys, weights, x, y, plane);
  if (a.geometric > 0.0f && cost < kNoMatch) cost += a.geometric * disagreement(GIVES_ARGUMENTS pair, x, y, plane.x);
  return cost;
}

/// Mean cost of the two of the chosen neighbours that match best: the point may be hidden in the others. Where one
/// alone shows the place, it has to match better; even more so where others could show it too. Without the latter,
/// planes that two neighbours match by chance would win over one that is hidden in all but one.
FN float plane_cost(TAKES_ARGUMENTS uint chosen, IN_ARRAY_OF(float, greys, 25), IN_ARRAY_OF(float, weights, 25),
                    float x, float y, vec3 plane) {
  const float alone = 0.1f, hidden_elsewhere = 0.2f;
  float first = kNotShown, second = kNotShown;
  for (uint k = 0u; k < a.pair_count; ++k) {
    if (((chosen >> k) & 1u) == 0u) continue;
    const float cost = pair_cost(GIVES_ARGUMENTS a.first_pair + k, greys, weights, x, y, plane);
    second = min(second, max(first, cost));
    first = min(first, cost);
  }
  return second < kNotShown ? min(0.5f * (first + second), first + hidden_elsewhere) : first + alone;
}

/// The neighbours in which a plane matches best, at most `compared`; bit k: neighbour k.
FN uint best_neighbours(TAKES_ARGUMENTS IN_ARRAY_OF(float, greys, 25), IN_ARRAY_OF(float, weights, 25), float x,
                        float y, vec3 plane) {
  vec4 costs = vec4(1e9f);  // ascending
  uvec4 bits = uvec4(0u);
  for (uint k = 0u; k < a.pair_count; ++k) {
    float cost = pair_cost(GIVES_ARGUMENTS a.first_pair + k, greys, weights, x, y, plane);
    uint bit = 1u << k;
    UNROLL for (int i = 0; i < 4; ++i) {
      if (cost < costs[i]) {
        const float larger = costs[i];
        const uint later = bits[i];
        costs[i] = cost;
        bits[i] = bit;
        cost = larger;
        bit = later;
      }
    }
  }
  return bits.x | bits.y | bits.z | bits.w;
}

/// The best plane of the other half of the pixels in one direction, moved to this pixel: of the near ones in a wedge,
/// or of the far ones along a line.
FN vec3 propagated(TAKES_ARGUMENTS int direction, int x, int y, vec3 own) {
  const int turn = direction & 3;
  const int forward_x = turn == 0 ? 1 : (turn == 1 ? -1 : 0), forward_y = turn == 2 ? 1 : (turn == 3 ? -1 : 0);
  float best = 1e9f;
  vec3 plane = own;
  for (int k = 0; k < 5; ++k) {
    const int side = direction < 4 ? (k == 0 ? 0 : (k == 1 ? 1 : (k == 2 ? -1 : (k == 3 ? 2 : -2)))) : 0;
    const int ahead = direction < 4 ? 1 + max(side, -side) : 3 + 2 * k;
    const int i = x + ahead * forward_x + side * forward_y, j = y + ahead * forward_y + side * forward_x;
    if (i < 0 || j < 0 || i >= int(a.width) || j >= int(a.height)) continue;
    const vec4 other = a.planes.v[a.pixel_offset + uint(j) * a.width + uint(i)];
    if (other.w < best) {
      best = other.w;
      plane = plane_moved(vec3(other.x, other.y, other.z), float(x - i), float(y - j));
    }
  }
  return plane;
}

/// A uniform random number in (-1, 1].
FN float random_change(uint seed, uint number) { return 2.0f * threshold_of(seed, number) - 1.0f; }

FN vec3 changed(TAKES_ARGUMENTS int kind, uint seed, vec3 plane) {
  const uint number = uint(kind) * 4u;
  const float size = a.pixel_step * a.change;
  vec3 result = plane;
  if (kind == 0) {
    // Anywhere in the range while changes are large; later a small change.
    if (a.change > 1.0f) return vec3(a.nearest * threshold_of(seed, number), plane.y, plane.z);
    result.x += 0.2f * size * random_change(seed, number);
    return result;
  }
  if (kind != 2) result.x += size * random_change(seed, number + 1u);
  if (kind != 1) {
    const float slope = min(0.5f, 0.25f * a.change) * a.pixel_step;
    result.y += slope * random_change(seed, number + 2u);
    result.z += slope * random_change(seed, number + 3u);
  }
  return result;
}

KERNEL_MAIN(64) {
  const uint thread = thread_index(), across = (a.width + 1u) / 2u;
  const uint row = thread / across, column = 2u * (thread % across) + ((row + a.colour) & 1u);
  if (row >= a.height || column >= a.width) return;
  const int x = int(column), y = int(row);
  const uint pixel = row * a.width + column, at = a.pixel_offset + pixel;
  const float grey = float(a.greys.v[at] & 255u);
  vec4 plane = a.planes.v[at];
  if (grey < 0.5f) {
    a.planes.v[at] = vec4(plane.x, plane.y, plane.z, kNoMatch);
    return;
  }
  float greys[25], weights[25];
  for (int k = 0; k < kPatchSamples; ++k) {
    const int i = clamp(x + patch_x(k), 0, int(a.width) - 1), j = clamp(y + patch_y(k), 0, int(a.height) - 1);
    const float value = float(a.greys.v[a.pixel_offset + uint(j) * a.width + uint(i)] & 255u);
    greys[k] = value;
    weights[k] = value < 0.5f ? 0.0f : likeness(value - grey);
  }
  const uint seed = threshold_pixel(a.key, pixel);
  vec3 best = vec3(plane.x, plane.y, plane.z);
  float least = 1e9f;
  const float steepest = a.pixel_step;
  uint chosen = ~0u;
  if (a.all_neighbours == 0u) chosen = best_neighbours(GIVES_ARGUMENTS greys, weights, float(x), float(y), best);
  for (int c = 0; c < 1 + kDirections + kChanges; ++c) {
    vec3 candidate = best;
    if (c > kDirections)
      candidate = changed(GIVES_ARGUMENTS c - 1 - kDirections, seed, best);
    else if (c > 0)
      candidate = propagated(GIVES_ARGUMENTS c - 1, x, y, best);
    candidate.y = clamp(candidate.y, -steepest, steepest);
    candidate.z = clamp(candidate.z, -steepest, steepest);
    if (!(candidate.x >= 0.0f && candidate.x <= a.nearest)) continue;
    const float cost = plane_cost(GIVES_ARGUMENTS chosen, greys, weights, float(x), float(y), candidate);
    if (cost < least) {
      least = cost;
      best = candidate;
    }
  }
  a.planes.v[at] = vec4(best.x, best.y, best.z, min(least, kNoMatch));
}
