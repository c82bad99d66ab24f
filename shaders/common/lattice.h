// Barycentric lattice textures (DiffSoup, section 3; see docs/method.md).
// Level R has the points (x, y), x + y <= r = 2^R, at barycentrics b0 = x / r, b1 = y / r.

FN uint lattice_samples(uint level) { return ((1u << level) + 1u) * ((1u << level) + 2u) / 2u; }

/// Diagonal by diagonal: the order of the published textures.
FN uint lattice_index(uint x, uint y) {
  const uint n = x + y;
  return n * (n + 1u) / 2u + y;
}

/// (x, y) of a sample's index.
FN void lattice_point(uint index, OUT(uint) x, OUT(uint) y) {
  uint n = uint((sqrt(real(8) * real(index) + real(1)) - real(1)) * real(0.5));
  // The square root may be off by one either way.
  while (n * (n + 1u) / 2u > index) --n;
  while ((n + 1u) * (n + 2u) / 2u <= index) ++n;
  y = index - n * (n + 1u) / 2u;
  x = n - y;
}

/// Three samples of a level and their weights, which sum to one.
struct LatticeCell {
  uint i0, i1, i2;
  real w0, w1, w2;
};

FN LatticeCell lattice_cell(real b0, real b1, uint level) {
  const uint r = 1u << level;
  const real u = b0 * real(r), v = b1 * real(r);
  const uint x = min(uint(max(u, real(0))), r - 1u);
  const uint y = min(uint(max(v, real(0))), r - 1u - x);
  const real fu = u - real(x), fv = v - real(y);
  LatticeCell cell;
  cell.i0 = lattice_index(x + 1u, y);
  cell.i1 = lattice_index(x, y + 1u);
  if (fu + fv <= real(1)) {
    cell.i2 = lattice_index(x, y);
    cell.w0 = fu;
    cell.w1 = fv;
    cell.w2 = real(1) - fu - fv;
  } else {
    // In the cells along the hypotenuse rounding can get here; there is no sample beyond it.
    cell.i2 = x + y + 2u <= r ? lattice_index(x + 1u, y + 1u) : lattice_index(x, y);
    cell.w0 = real(1) - fv;
    cell.w1 = real(1) - fu;
    cell.w2 = fu + fv - real(1);
  }
  return cell;
}

/// Exactly v when all three values are v: a lattice of 0.5 must pass a threshold of 0.5 everywhere.
FN real lattice_mix(LatticeCell cell, real v0, real v1, real v2) {
  return v2 + cell.w0 * (v0 - v2) + cell.w1 * (v1 - v2);
}

/// Exactly 0.5 at 0, which division and exponential of a GPU need not give: new opacities must pass a threshold of 0.5.
FN real sigmoid(real x) { return x == real(0) ? real(0.5) : real(1) / (real(1) + exp(-x)); }
