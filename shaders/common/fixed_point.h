// Sums that are the same in any order: 64-bit fixed point in two 32-bit words, added with 32-bit atomics, which every device has.
// The low words start at 2^31, so that small terms of either sign rarely touch the high word. Words live in two arrays.

const uint kFixedZero = 0x80000000u;  // low word of an empty sum
const float kFixedOne = 17592186044416.0;      // 2^44: resolution 6e-14, range +-5e5
const float kFixedInverse = 5.684341886080802e-14;
const float kFixedLimit = 262144.0;  // a single term is clamped to +-2^18

/// Words of x, or of zero if x is not a number.
uvec2 to_fixed(float x) {
  if (!(abs(x) <= kFixedLimit)) x = x > 0.0 ? kFixedLimit : x < 0.0 ? -kFixedLimit : 0.0;
  const float scaled = abs(x) * kFixedOne;
  const float high = floor(scaled * 2.3283064365386963e-10);
  uvec2 words = uvec2(uint(scaled - high * 4294967296.0), uint(high));
  if (x < 0.0) {
    words = ~words;
    words.x += 1u;
    if (words.x == 0u) words.y += 1u;
  }
  return words;
}

float from_fixed(uint low, uint high) {
  // Take the offset of the low word away, then the sign.
  uint l = low - kFixedZero;
  uint h = high - (low < kFixedZero ? 1u : 0u);
  const bool negative = (h & 0x80000000u) != 0u;
  if (negative) {
    l = ~l + 1u;
    h = ~h + (l == 0u ? 1u : 0u);
  }
  const float magnitude = (float(h) * 4294967296.0 + float(l)) * kFixedInverse;
  return negative ? -magnitude : magnitude;
}

void add_fixed(Uints low, uint low_index, Uints high, uint high_index, float x) {
  const uvec2 words = to_fixed(x);
  if (words.x == 0u && words.y == 0u) return;
  const uint before = atomicAdd(low.v[low_index], words.x);
  const uint carried = words.y + (before + words.x < before ? 1u : 0u);
  if (carried != 0u) atomicAdd(high.v[high_index], carried);
}
