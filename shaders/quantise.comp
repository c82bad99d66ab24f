// Textures to 8 bits, rounded to the nearest; what is no number becomes 0.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/glsl.h"
#include "args/quantise.h"

layout(local_size_x = 64) in;
layout(push_constant) uniform Push { QuantiseArgs a; };

uint packed_bytes(vec4 value) {
  uint word = 0u;
  UNROLL for (uint c = 0u; c < 4u; ++c) {
    // Adding a half before rounding down would round twice.
    const float scaled = value[c] >= 0.0 ? min(value[c], 1.0) * 255.0 : 0.0, down = floor(scaled);
    word |= (uint(down) + (scaled - down >= 0.5 ? 1u : 0u)) << (8u * c);
  }
  return word;
}

void main() {
  const uint i = thread_index();
  if (i >= a.samples) return;
  a.packed.v[2u * i] = packed_bytes(a.lattice.v[2u * i]);
  a.packed.v[2u * i + 1u] = packed_bytes(a.lattice.v[2u * i + 1u]);
}
