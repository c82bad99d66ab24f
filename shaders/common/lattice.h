// Barycentric lattice textures (DiffSoup, section 3; docs/method.md). Level R has the points (x, y), x + y <= r = 2^R,
// at barycentrics b0 = x / r, b1 = y / r.

FN uint lattice_samples(uint level) { return ((1u << level) + 1u) * ((1u << level) + 2u) / 2u; }

/// Index of a sample. Samples are ordered by diagonals, as in the published textures.
FN uint lattice_index(uint x, uint y) {
  const uint n = x + y;
  return n * (n + 1u) / 2u + y;
}

/// Position (x, y) of a sample.
FN void lattice_point(uint index, OUT(uint) x, OUT(uint) y) {
  // Diagonal n starts where 8 index + 1 = (2 n + 1)^2 and ends 8 below the next square. Because of the added half, the
  // root may be off by 0.003 in either direction, which holds for all diagonals up to n = 32, the longest.
  const uint n = uint((sqrt(real(8) * real(index) + real(1.5)) - real(1)) * real(0.5));
  y = index - n * (n + 1u) / 2u;
  x = n - y;
}

/// The two samples of the next coarser level between which sample (x, y) lies. Both are the same if the sample belongs
/// to the coarser level.
FN void coarse_neighbours(uint x, uint y, OUT(uint) p, OUT(uint) q) {
  const uint n = (x >> 1) + (y >> 1), at = lattice_index(x >> 1, y >> 1);
  p = at + (x & 1u) * (n + 1u);
  q = at + (y & 1u) * (n + 2u);
}

/// Index in the next finer level of the sample at the position of sample `index`.
FN uint finer_index(uint index) {
  uint x, y;
  lattice_point(index, x, y);
  return lattice_index(2u * x, 2u * y);
}

/// Three samples of a level and their weights, which sum to 1.
struct LatticeCell {
  uint i0, i1, i2;
  real w0, w1, w2;
};

/// The square of four lattice points that contains a point of the triangle. (x, y): its lowest point. fu, fv: the
/// position inside, 0..1.
struct LatticeSquare {
  uint x, y;
  real fu, fv;
};

FN LatticeSquare lattice_square(real b0, real b1, uint level) {
  const uint r = 1u << level;
  const real u = b0 * real(r), v = b1 * real(r);
  LatticeSquare square;
  square.x = min(uint(max(u, real(0))), r - 1u);
  square.y = min(uint(max(v, real(0))), r - 1u - square.x);
  square.fu = u - real(square.x);
  square.fv = v - real(square.y);
  return square;
}

/// Whether the point is in the half next to the square's lowest point. The third sample of the other half is (x + 1, y
/// + 1).
FN bool lower_half(LatticeSquare square) { return square.fu + square.fv <= real(1); }
/// Squares along the hypotenuse have no upper half, but rounding can place a point there.
FN bool has_upper_half(LatticeSquare square, uint level) { return square.x + square.y + 2u <= (1u << level); }

FN LatticeCell lattice_cell(real b0, real b1, uint level) {
  const LatticeSquare square = lattice_square(b0, b1, level);
  const uint x = square.x, y = square.y;
  const real fu = square.fu, fv = square.fv;
  LatticeCell cell;
  cell.i0 = lattice_index(x + 1u, y);
  cell.i1 = lattice_index(x, y + 1u);
  if (lower_half(square)) {
    cell.i2 = lattice_index(x, y);
    cell.w0 = fu;
    cell.w1 = fv;
    cell.w2 = real(1) - fu - fv;
  } else {
    cell.i2 = has_upper_half(square, level) ? lattice_index(x + 1u, y + 1u) : lattice_index(x, y);
    cell.w0 = real(1) - fv;
    cell.w1 = real(1) - fu;
    cell.w2 = fu + fv - real(1);
  }
  return cell;
}

/// The texture without its finest level: samples of a lattice of `level` at the points of the next coarser level, and
/// their weights.
FN LatticeCell coarser_cell(real b0, real b1, uint level) {
  if (level == 0u) return lattice_cell(b0, b1, level);
  LatticeCell cell = lattice_cell(b0, b1, level - 1u);
  cell.i0 = finer_index(cell.i0);
  cell.i1 = finer_index(cell.i1);
  cell.i2 = finer_index(cell.i2);
  return cell;
}

/// Returns exactly v if all three values are v: a lattice of 0.5 must pass a threshold of 0.5 everywhere.
FN real lattice_mix(LatticeCell cell, real v0, real v1, real v2) {
  return v2 + cell.w0 * (v0 - v2) + cell.w1 * (v1 - v2);
}

/// Inverse of sigmoid for p from 0.02 to 0.98: log(p / (1 - p)) as 16 times the logarithm of its 16th root, with the
/// series of the inverse hyperbolic tangent. Roots and products give the same bits on more devices than a logarithm
/// does.
FN real logit(real p) {
  const real root = sqrt(sqrt(sqrt(sqrt(p / (real(1) - p)))));
  const real z = (root - real(1)) / (root + real(1)), zz = z * z;
  return real(32) * z * (real(1) + zz * (real(1) / real(3) + zz * (real(1) / real(5) + zz * (real(1) / real(7)))));
}

/// Returns exactly 0.5 at 0, which a GPU's division and exponential do not guarantee. New opacities must pass a
/// threshold of 0.5.
FN real sigmoid(real x) { return x == real(0) ? real(0.5) : real(1) / (real(1) + exp(-x)); }
