// Order-independent sums: 64-bit fixed point in two 32-bit words, which only needs 32-bit atomics. Low words start at
// 2^31, so that small terms of either sign rarely change the high word. The words are in two arrays.

const uint kFixedZero = 0x80000000u;        // low word of an empty sum
const float kFixedOne = 17592186044416.0f;  // 2^44: resolution 6e-14, range +-5e5
const float kFixedInverse = 5.684341886080802e-14f;
const float kFixedLimit = 64.0f;  // a single term is clamped: 8,192 of them fit; terms of a mean loss are far below 1

/// Clamps a term to kFixedLimit. NaN becomes zero.
FN float limited(float x) {
  return abs(x) <= kFixedLimit ? x : x > 0.0f ? kFixedLimit : x < 0.0f ? -kFixedLimit : 0.0f;
}

/// Converts x to its words; NaN becomes zero. The remainder of x after the high word fits exactly in a signed low word.
FN uvec2 to_fixed(float x) {
  const float scaled = limited(x) * kFixedOne;
  const float high = floor(scaled * 2.3283064365386963e-10f + 0.5f);
  const int low = int(scaled - high * 4294967296.0f);
  return uvec2(uint(low), uint(int(high) + (low >> 31)));
}

/// The low word minus its offset is a signed number.
FN float from_fixed(uint low, uint high) {
  return float(int(high)) * 0.000244140625f + float(int(low ^ kFixedZero)) * kFixedInverse;
}

FN void add_fixed(Uints low, uint low_index, Uints high, uint high_index, float x) {
  const uvec2 words = to_fixed(x);
  if (words.x == 0u && words.y == 0u) return;
  const uint before = atomicAdd(low.v[low_index], words.x);
  const uint carried = words.y + (before + words.x < before ? 1u : 0u);
  if (carried != 0u) atomicAdd(high.v[high_index], carried);
}
