// One triangle's texture: gradient on the finest lattice through the sigmoid and down to every level, Adam on all levels, their
// sum up to the finest lattice again, sigmoid. The hat functions of the levels are nested, so both directions go one level at a
// time: a coarse sample takes its own fine sample's gradient and half of the six around it.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/glsl.h"
#include "args/update_textures.h"
#include "common/fixed_point.h"
#include "common/lattice.h"
#include "common/optimiser.h"

layout(local_size_x = 64) in;
layout(constant_id = 0) const uint SAMPLES = 774u;  // the most that a triangle of this launch has, all levels
layout(constant_id = 1) const uint CHANNELS = 8u;   // of the 8, per workgroup: what fits in shared memory
layout(constant_id = 2) const bool ADAM = true;     // false: only sum the levels
layout(constant_id = 3) const bool DEBUG = false;   // also write the gradient
layout(push_constant) uniform Push { UpdateTexturesArgs a; };

shared float s_value[SAMPLES * CHANNELS];

uint samples_before(uint level_min, uint level) {
  uint n = 0u;
  for (uint l = level_min; l < level; ++l) n += lattice_samples(l);
  return n;
}

void main() {
  const uint groups_per_triangle = 8u / CHANNELS;
  const uint triangle = group_index() / groups_per_triangle;
  const uint channel0 = (group_index() % groups_per_triangle) * CHANNELS;
  const uint thread = gl_LocalInvocationIndex;
  if (triangle >= a.triangles) return;
  const Texture row = a.textures.v[triangle];
  const uint fine = samples_before(row.level_min, row.level_max), fine_count = lattice_samples(row.level_max);
  const bool frozen = a.control.v[0].overflow != 0u;

  if (ADAM) {
    for (uint e = thread; e < fine_count * CHANNELS; e += 64u) {
      const uint at = (row.lattice_offset + e / CHANNELS) * 8u + channel0 + e % CHANNELS;
      const uint low = a.gradient_low.v[at], high = a.gradient_high.v[at];
      float gradient = 0.0;
      if (low != kFixedZero || high != 0u) {
        const float value = a.lattice.v[at];
        gradient = from_fixed(low, high) * value * (1.0 - value);
        a.gradient_low.v[at] = kFixedZero;
        a.gradient_high.v[at] = 0u;
      }
      s_value[fine * CHANNELS + e] = gradient;
    }
    for (uint level = row.level_max; level > row.level_min; --level) {
      barrier();
      const uint from = samples_before(row.level_min, level), to = samples_before(row.level_min, level - 1u);
      const uint r = 1u << level;
      for (uint e = thread; e < lattice_samples(level - 1u) * CHANNELS; e += 64u) {
        const uint c = e % CHANNELS;
        uint x, y;
        lattice_point(e / CHANNELS, x, y);
        x *= 2u;
        y *= 2u;
        float around = 0.0;
        if (x + y < r) {
          around += s_value[(from + lattice_index(x + 1u, y)) * CHANNELS + c];
          around += s_value[(from + lattice_index(x, y + 1u)) * CHANNELS + c];
        }
        if (x > 0u) {
          around += s_value[(from + lattice_index(x - 1u, y)) * CHANNELS + c];
          around += s_value[(from + lattice_index(x - 1u, y + 1u)) * CHANNELS + c];
        }
        if (y > 0u) {
          around += s_value[(from + lattice_index(x, y - 1u)) * CHANNELS + c];
          around += s_value[(from + lattice_index(x + 1u, y - 1u)) * CHANNELS + c];
        }
        s_value[to * CHANNELS + e] = s_value[(from + lattice_index(x, y)) * CHANNELS + c] + 0.5 * around;
      }
    }
    barrier();
  }

  const float rate = a.state.v[0].rate_texture, second = a.state.v[0].second_texture;
  for (uint e = thread; e < (fine + fine_count) * CHANNELS; e += 64u) {
    const uint at = (row.source_offset + e / CHANNELS) * 8u + channel0 + e % CHANNELS;
    float logit = a.source.v[at];
    if (ADAM) {
      const float gradient = s_value[e];
      if (DEBUG) a.debug.v[at] = gradient;
      if (!frozen) {
        float m = a.moment1.v[at], v = a.moment2.v[at];
        logit -= adam(gradient, rate, second, m, v);
        a.moment1.v[at] = m;
        a.moment2.v[at] = v;
        a.source.v[at] = logit;
      }
    }
    s_value[e] = logit;
  }

  for (uint level = row.level_min + 1u; level <= row.level_max; ++level) {
    barrier();
    const uint from = samples_before(row.level_min, level - 1u), to = samples_before(row.level_min, level);
    for (uint e = thread; e < lattice_samples(level) * CHANNELS; e += 64u) {
      const uint c = e % CHANNELS;
      uint x, y;
      lattice_point(e / CHANNELS, x, y);
      // The two coarse samples that a fine one lies between; the same one twice where they coincide.
      const uint x0 = x >> 1, y0 = y >> 1, ox = x & 1u, oy = y & 1u;
      const uint i = lattice_index(x0 + ox, y0), j = lattice_index(x0, y0 + oy);
      s_value[to * CHANNELS + e] += 0.5 * (s_value[(from + i) * CHANNELS + c] + s_value[(from + j) * CHANNELS + c]);
    }
  }
  barrier();
  for (uint e = thread; e < fine_count * CHANNELS; e += 64u) {
    const uint sample_index = row.lattice_offset + e / CHANNELS, channel = channel0 + e % CHANNELS;
    const float value = sigmoid(s_value[fine * CHANNELS + e]);
    a.lattice.v[sample_index * 8u + channel] = value;
    if (channel == 7u) a.opacity.v[sample_index] = value;
  }
}
