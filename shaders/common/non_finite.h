// Non-finite parameters, and values too large to compute with. Gradients cannot produce them (common/fixed_point.h),
// but a damaged checkpoint or memory can. They are tested by their bits, because a compiler may assume that no value is
// NaN.

// Weights below this limit produce no infinity or NaN in the forward or backward pass.
const float kLargestWeight = 8.5e9f;
const float kLargestLogit = 1e30f;
// Edge functions are products of at most three coordinates. Coordinates below this limit do not overflow.
const float kLargestCoordinate = 1e12f;

FN bool is_finite(float x) { return (floatBitsToUint(x) & 0x7f800000u) != 0x7f800000u; }
FN bool usable(float x, float limit) { return (floatBitsToUint(x) & 0x7fffffffu) < floatBitsToUint(limit); }
FN bool usable(vec3 x, float limit) { return usable(x.x, limit) && usable(x.y, limit) && usable(x.z, limit); }

/// Records for the host that a parameter had to be reset. kind: NON_FINITE_; index: of the float in its array. Only one
/// of the first indices is kept.
FN void note_non_finite(Controls control, uint kind, uint index, uint step) {
  if (atomicAdd(control.v[0].non_finite[kind].count, 1u) != 0u) return;
  control.v[0].non_finite[kind].index = index;
  control.v[0].non_finite[kind].step = step;
}
