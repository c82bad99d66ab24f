// Transfers between the levels of a texture, in an array that stores levels coarse to fine. The hat functions of the
// levels are nested, so both directions proceed one level at a time. Needs lattice.h, FLOATS, and SAMPLE_VALUE(i, e):
// element e of sample i of the array.

/// Returns the index of the first sample of a level.
FN uint samples_before(uint level_min, uint level) {
  uint n = 0u;
  for (uint l = level_min; l < level; ++l) n += lattice_samples(l);
  return n;
}

/// Transpose of interpolation: the sum that sample i of the next coarser level receives from the samples of `level`,
/// which start at `from`. It is the value of the fine sample at its position plus half of the six neighbours.
FN FLOATS gathered(uint from, uint level, uint i, uint e) {
  uint x, y;
  lattice_point(i, x, y);
  // n: diagonal of the finer level's sample at the same position. The neighbours' indices follow from the diagonal
  // order.
  const uint n = 2u * (x + y), at = from + lattice_index(2u * x, 2u * y);
  FLOATS around = FLOATS(0.0f);
  if (n < (1u << level)) {
    around += SAMPLE_VALUE(at + n + 1u, e);
    around += SAMPLE_VALUE(at + n + 2u, e);
  }
  if (x > 0u) {
    around += SAMPLE_VALUE(at - n, e);
    around += SAMPLE_VALUE(at + 1u, e);
  }
  if (y > 0u) {
    around += SAMPLE_VALUE(at - n - 1u, e);
    around += SAMPLE_VALUE(at - 1u, e);
  }
  return SAMPLE_VALUE(at, e) + 0.5f * around;
}
