// Powers of positive numbers, with the same bits on every backend but for e^x. Float only.

/// Natural logarithm of a normal number > 0; error below 2e-7 or relative 2e-7.
FN float logarithm(float x) {
  // x = m 2^e with m from sqrt(1/2) to sqrt(2); log m = 2 artanh((m - 1) / (m + 1)).
  const uint bits = floatBitsToUint(x);
  const int e = int(bits - 0x3f3504f3u) >> 23;
  const float m = uintBitsToFloat(bits - (uint(e) << 23));
  const float t = (m - 1.0f) / (m + 1.0f), s = t * t;
  const float series = 1.0f + s * (0.33333333f + s * (0.2f + s * (0.14285714f + s * 0.11111111f)));
  return float(e) * 0.69314718f + 2.0f * t * series;
}

/// x^p; 0 for x below 1e-30.
FN float power(float x, float p) { return x > 1e-30f ? exp(p * logarithm(x)) : 0.0f; }
