// Second pass: the colour of a visible fragment. Neural shading once per pixel, or one of the inspection modes.

#define MODE_COLOUR 0u
#define MODE_TRIANGLES 1u
#define MODE_NORMALS 2u
#define MODE_DEPTH 3u
#define MODE_OPACITY 4u
#define MODE_LEVEL 5u
#define MODE_WIREFRAME 6u
#define MODE_CHANNEL 7u

layout(constant_id = 0) const uint MODE = MODE_COLOUR;
layout(binding = 2) uniform sampler2DArray features;  // features 0..3 of a lattice point; 4..7 are in the next layer
layout(binding = 5) uniform BatchBuffers { DrawFrame frame; };
#include "common/soup_table.h"

// The MLP's parameters. Either specialisation constants, which doubles the speed on a CPU but needs a compilation per
// model, or a uniform buffer, for models that are still changing.
#ifdef FIXED_MLP
#include "mlp_constants.h"
#define MLP(i) fixed_mlp[i]
#else
layout(binding = 4) uniform Mlp { vec4 mlp[149]; };
#define MLP(i) mlp[(i) >> 2][(i)&3]
#endif
#define LANES float
#include "common/shading.h"

void features_at(SoupTriangle t, vec2 b, out float f[8]) {
  const uint level = t.layer_level & 255u;
  const LatticeSquare square = lattice_square(b.x, b.y, level);
  const AtlasSquare s = atlas_square(t.place, t.layer_level, square);
  const SquareWeights w = square_weights(square, level);
  const ivec3 i0 = ivec3(s.at + ivec2(s.step, 0), 2 * s.page), i1 = ivec3(s.at + ivec2(0, s.step), 2 * s.page);
  const ivec3 i2 = ivec3(s.at + (w.upper ? ivec2(s.step) : ivec2(0)), 2 * s.page), next = ivec3(0, 0, 1);
  const vec4 a0 = texelFetch(features, i0, 0), a1 = texelFetch(features, i1, 0), a2 = texelFetch(features, i2, 0);
  const vec4 b0 = texelFetch(features, i0 + next, 0), b1 = texelFetch(features, i1 + next, 0),
             b2 = texelFetch(features, i2 + next, 0);
  const vec4 low = a2 + w.w0 * (a0 - a2) + w.w1 * (a1 - a2), high = b2 + w.w0 * (b0 - b2) + w.w1 * (b1 - b2);
  UNROLL for (int c = 0; c < 4; ++c) {
    f[c] = low[c];
    f[4 + c] = high[c];
  }
}

vec3 neural_colour(float f[8], vec2 ndc) {
  float x[16], h1[16], h2[16], y[3], sh[9];
  spherical_harmonics(normalize(to_camera(ndc)), sh);
  UNROLL for (int i = 0; i < 7; ++i) x[i] = f[i];
  UNROLL for (int i = 0; i < 9; ++i) x[7 + i] = sh[i];
  mlp_forward(x, h1, h2, y);
  return skip_connection(float[7](f[0], f[1], f[2], f[3], f[4], f[5], f[6]), vec3(y[0], y[1], y[2]));
}

/// A random colour that distinguishes triangles with adjacent indices.
vec3 random_colour(uint triangle) {
  uint h = triangle * 0x9e3779b9u;
  h = (h ^ (h >> 16)) * 0x85ebca6bu;
  h ^= h >> 13;
  return 0.25 + 0.75 * vec3(h & 255u, (h >> 8) & 255u, (h >> 16) & 255u) / 255.0;
}

/// Distance from the pixel to the triangle's nearest edge, in pixels.
float edge_distance(SoupTriangle t, vec2 ndc) {
  const vec4 p0 = frame.clip_from_world * vec4(t.v2 + t.e0, 1.0);
  const vec4 p1 = frame.clip_from_world * vec4(t.v2 + t.e1, 1.0);
  const vec4 p2 = frame.clip_from_world * vec4(t.v2, 1.0);
  const TriangleSetup s = triangle_setup(p0, p1, p2, ndc);
  const vec2 pixel = vec2(frame.pixel_x, frame.pixel_y);
  // An edge function divided by the length of its gradient per pixel is the screen distance to that edge.
  return min(abs(s.e0.x) / length(s.e0.yz * pixel),
             min(abs(s.e1.x) / length(s.e1.yz * pixel), abs(s.e2.x) / length(s.e2.yz * pixel)));
}

/// hit: nonzero output of the first pass. ndc: of the pixel or sample.
vec3 surface_colour(uint hit, vec2 ndc) {
  if (MODE == MODE_TRIANGLES) return random_colour(hit - 1u);
  const SoupTriangle t = soup_triangle(hit - 1u);
  if (MODE == MODE_NORMALS) {
    const vec3 n = normalize(cross(t.e0, t.e1));
    return 0.5 + 0.5 * (dot(n, to_camera(ndc)) < 0.0 ? -n : n);
  }
  const vec2 b = barycentrics(t, ndc);
  if (MODE == MODE_DEPTH) {
    const float w = (frame.clip_from_world * vec4(t.v2 + b.x * t.e0 + b.y * t.e1, 1.0)).w;
    return vec3(clamp(1.0 - (w - frame.depth_near) / (frame.depth_far - frame.depth_near), 0.0, 1.0));
  }
  float f[8];
  features_at(t, b, f);
  if (MODE == MODE_OPACITY) return vec3(f[7]);
  if (MODE == MODE_CHANNEL) {
    float value = f[0];
    UNROLL for (uint c = 1u; c < 8u; ++c) value = frame.channel == c ? f[c] : value;
    return vec3(value);
  }
  if (MODE == MODE_LEVEL) {
    const float height = float(t.layer_level & 255u) / 5.0;
    return mix(mix(vec3(0.1, 0.2, 0.7), vec3(0.2, 0.75, 0.4), min(2.0 * height, 1.0)), vec3(0.95, 0.85, 0.2),
               max(2.0 * height - 1.0, 0.0));
  }
  const vec3 colour = neural_colour(f, ndc);
  if (MODE == MODE_WIREFRAME) {
    const float line = clamp(1.5 - edge_distance(t, ndc), 0.0, 1.0);
    return mix(mix(colour, vec3(1.0), 0.6), vec3(0.05, 0.1, 0.25), line);
  }
  return colour;
}
