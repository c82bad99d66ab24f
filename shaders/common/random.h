// Counter-based random numbers: the same counters give the same number in any order and on any device.

/// 32-bit hash with avalanche effect (constants from C. Wellons' search for low bias).
FN uint hash32(uint x) {
  x ^= x >> 16;
  x *= 0x7feb352du;
  x ^= x >> 15;
  x *= 0x846ca68bu;
  x ^= x >> 16;
  return x;
}

/// The part of a threshold's counter that does not depend on the triangle. key: hash of seed, step and view.
FN uint threshold_pixel(uint key, uint pixel) { return hash32(key ^ (pixel * 0x9e3779b9u)); }

/// Returns a uniform threshold in (0, 1] with 24 bits: opacity 0 never passes, opacity 1 always does.
FN real threshold_of(uint pixel_hash, uint triangle) {
  return real((hash32(pixel_hash + triangle * 0x85ebca6bu) >> 8) + 1u) * real(5.9604644775390625e-8);
}
