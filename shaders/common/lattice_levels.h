// From one level of a texture to the next, in an array that holds levels coarse to fine. The hat functions of the
// levels are nested, so both directions go one level at a time. Needs lattice.h, FLOATS, and SAMPLE_VALUE(i, e):
// element e of sample i of the array.

/// Where the samples of a level begin.
FN uint samples_before(uint level_min, uint level) {
  uint n = 0u;
  for (uint l = level_min; l < level; ++l) n += lattice_samples(l);
  return n;
}

/// Transpose of interpolation: what the samples of `level`, which begin at `from`, hand to sample i of the next coarser
/// one. It takes its own fine sample's value and half of the six around it.
FN FLOATS gathered(uint from, uint level, uint i, uint e) {
  uint x, y;
  lattice_point(i, x, y);
  // The finer level's sample in the same place and its diagonal; the neighbours' numbers follow from the order,
  // diagonal by diagonal.
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
