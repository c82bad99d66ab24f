// Lattices in atlas images (soup::Atlas): position of a lattice square.

struct AtlasSquare {
  ivec2 at;  // texel of the square's lowest point
  int step;  // 1, or -1 if the lattice is turned
  int page;
  uint level;
};

AtlasSquare atlas_square(uint place, uint layer_level, LatticeSquare square) {
  AtlasSquare s;
  s.step = (layer_level >> 16) != 0u ? -1 : 1;
  s.page = int((layer_level >> 8) & 255u);
  s.level = layer_level & 255u;
  s.at = ivec2(int(place & 65535u), int(place >> 16)) + s.step * ivec2(int(square.x), int(square.y));
  return s;
}

/// Interpolation weights of the square's points (x + 1, y) and (x, y + 1). The third point is (x, y), or (x + 1, y + 1)
/// if `upper`.
struct SquareWeights {
  float w0, w1;
  bool upper;
};

SquareWeights square_weights(LatticeSquare square, uint level) {
  SquareWeights w;
  const bool lower = lower_half(square);
  w.upper = !lower && has_upper_half(square, level);
  w.w0 = lower ? square.fu : 1.0 - square.fv;
  w.w1 = lower ? square.fv : 1.0 - square.fu;
  return w;
}
