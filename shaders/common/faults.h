// Parameters that are not numbers, or too large to compute with. No gradient makes one (common/fixed_point.h), but a
// damaged checkpoint or memory may. They are told by their bits: a compiler may take for granted that no value is one.

// An MLP of weights below this has neither an infinity nor a NaN anywhere, forward or backward.
const float kLargestWeight = 8.5e9f;
const float kLargestLogit = 1e30f;
// Edge functions are products of three coordinates at most: below this none overflows.
const float kLargestCoordinate = 1e12f;

FN bool usable(float x, float limit) { return (floatBitsToUint(x) & 0x7fffffffu) < floatBitsToUint(limit); }
FN bool usable(vec3 x, float limit) { return usable(x.x, limit) && usable(x.y, limit) && usable(x.z, limit); }

/// For the host: a parameter had to be reset. kind: FAULT_; index: of the float in its array. The place of one of the
/// first is kept.
FN void note_fault(Controls control, uint kind, uint index, uint step) {
  if (atomicAdd(control.v[0].faults[kind].count, 1u) != 0u) return;
  control.v[0].faults[kind].index = index;
  control.v[0].faults[kind].step = step;
}
