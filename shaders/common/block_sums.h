// Order-independent sums of a workgroup in shared memory: integers in units of a power of two, chosen so that no sum
// exceeds 32 bits. Needs fixed_point.h.

/// Returns the biased float exponent of the unit. A sum of `terms` terms of at most `max_term` each stays below 2^30
/// units.
FN uint unit_exponent(uint terms, float max_term) {
  return max(floatBitsToUint(float(terms) * max_term) >> 23, 30u) - 29u;
}
FN float unit_of(uint exponent) { return uintBitsToFloat(exponent << 23); }
FN float units_per_one(uint exponent) { return uintBitsToFloat((254u - exponent) << 23); }

/// Converts x, given in units, to a word for addition. Rounds half away from zero.
FN uint whole_units(float x) {
  return uint(int(x + uintBitsToFloat((floatBitsToUint(x) & 0x80000000u) | 0x3f000000u)));
}
