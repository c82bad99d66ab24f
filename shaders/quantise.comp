// Rounds textures to 8 bits. NaN becomes 0.
#include "common/kernel.h"
#include "args/quantise.h"

FN uint packed_bytes(vec4 value) {
  uint word = 0u;
  UNROLL for (uint c = 0u; c < 4u; ++c) {
    // Adding 0.5 before rounding down would round twice.
    const float scaled = value[c] >= 0.0f ? min(value[c], 1.0f) * 255.0f : 0.0f, down = floor(scaled);
    word |= (uint(down) + (scaled - down >= 0.5f ? 1u : 0u)) << (8u * c);
  }
  return word;
}

KERNEL(64, QuantiseArgs) {
  const uint i = thread_index();
  if (i >= a.samples) return;
  a.packed.v[2u * i] = packed_bytes(a.lattice.v[2u * i]);
  a.packed.v[2u * i + 1u] = packed_bytes(a.lattice.v[2u * i + 1u]);
}
