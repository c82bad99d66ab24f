// Features of a pixel's visible fragment and the direction it is seen from: the MLP's 16 inputs.
void fragment_features(Floats lattice, uint offset, LatticeCell cell, out float x[16]) {
  const uint i0 = (offset + cell.i0) * 8u, i1 = (offset + cell.i1) * 8u, i2 = (offset + cell.i2) * 8u;
  UNROLL for (uint c = 0u; c < 7u; ++c) x[c] = lattice_mix(cell, lattice.v[i0 + c], lattice.v[i1 + c], lattice.v[i2 + c]);
}

void view_inputs(Views views, uint view, uint px, uint py, inout float x[16]) {
  const vec2 ndc = pixel_ndc(px, py, views.v[view].width, views.v[view].height);
  const vec3 direction =
      normalize(views.v[view].ray.xyz + ndc.x * views.v[view].ray_x.xyz + ndc.y * views.v[view].ray_y.xyz);
  float y[9];
  spherical_harmonics(direction, y);
  UNROLL for (int i = 0; i < 9; ++i) x[7 + i] = y[i];
}
