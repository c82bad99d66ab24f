// Sums of a workgroup in shared memory that are the same in any order: whole numbers of a unit that is a power of two,
// chosen so that none of them leaves 32 bits. Needs fixed_point.h.

/// Exponent of the unit in which the sum of `terms` terms, none larger than `most`, stays below 2^30: as floats have
/// it, biased.
FN uint unit_exponent(uint terms, float most) { return max(floatBitsToUint(float(terms) * most) >> 23, 30u) - 29u; }
FN float unit_of(uint exponent) { return uintBitsToFloat(exponent << 23); }
FN float units_per_one(uint exponent) { return uintBitsToFloat((254u - exponent) << 23); }

/// x, which is in units, as a word to add: rounded, halves away from zero.
FN uint whole_units(float x) {
  return uint(int(x + uintBitsToFloat((floatBitsToUint(x) & 0x80000000u) | 0x3f000000u)));
}
