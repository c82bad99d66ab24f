// Texture lookup of the seven features. Needs lattice.h.

FN void fragment_features(Float4s lattice, uint offset, LatticeCell cell, OUT_ARRAY(f, 7)) {
  const uint i0 = (offset + cell.i0) * 2u, i1 = (offset + cell.i1) * 2u, i2 = (offset + cell.i2) * 2u;
  const vec4 a0 = lattice.v[i0], a1 = lattice.v[i1], a2 = lattice.v[i2];
  const vec4 b0 = lattice.v[i0 + 1u], b1 = lattice.v[i1 + 1u], b2 = lattice.v[i2 + 1u];
  UNROLL for (uint c = 0u; c < 4u; ++c) f[c] = lattice_mix(cell, a0[c], a1[c], a2[c]);
  UNROLL for (uint c = 0u; c < 3u; ++c) f[4u + c] = lattice_mix(cell, b0[c], b1[c], b2[c]);
}
