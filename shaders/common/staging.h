// Loads a tile's list of triangles into shared memory, 64 at a time, as edge functions relative to the tile centre.
SHARED vec4 s_e0[64], s_e1[64], s_e2[64], s_plane[64];
SHARED uvec4 s_texture[64];  // lattice offset, level, triangle

FN void stage_triangle(uint slot, uint triangle, ScreenTriangles screen, uint first, Textures textures, vec2 origin) {
  const uint at = first + triangle;
  const TriangleSetup setup = triangle_setup(screen.v[at].p0, screen.v[at].p1, screen.v[at].p2, origin);
  // A triangle without area on the screen covers nothing.
  s_e0[slot] = vec4(setup.valid ? setup.e0 : vec3(-1.0f, 0.0f, 0.0f), 0.0f);
  s_e1[slot] = vec4(setup.e1, 0.0f);
  s_e2[slot] = vec4(setup.e2, 0.0f);
  s_plane[slot] = vec4(setup.plane, 0.0f);
  s_texture[slot] = uvec4(textures.v[triangle].lattice_offset, textures.v[triangle].level_max, triangle, 0u);
}

/// Returns a bit mask for up to 32 staged triangles, slots `first` to `end`. Bit k is set if triangle first + k covers
/// the pixel at offset d nearer than `limit`, or at equal depth with an index below `index_end` (equal depths go to the
/// lower index). Pure arithmetic, identical for all pixels; afterwards each pixel reads memory only for its own few
/// fragments. Testing and reading in one loop would read for every triangle that covers any pixel of a SIMD group, or,
/// where branches are masks (llvmpipe), for all triangles.
FN uint covering(uint first, uint end, vec2 d, float limit, uint index_end) {
  uint bits = 0u;
  for (uint k = first; k < min(first + 32u, end); ++k) {
    const float e0 = at_offset(vec3(s_e0[k]), d), e1 = at_offset(vec3(s_e1[k]), d), e2 = at_offset(vec3(s_e2[k]), d);
    const float depth = at_offset(vec3(s_plane[k]), d);
    // Avoids && and ?:, which would be unpredictable branches.
    const bool first_of_equals = all(bvec2(depth == limit, s_texture[k].z < index_end));
    const bool covers = all(bvec4(min(e0, min(e1, e2)) >= 0.0f, e0 + e1 + e2 > 0.0f, depth > -1.0f,
                                  any(bvec2(depth < limit, first_of_equals))));
    bits |= (0u - uint(covers)) & (1u << (k - first));
  }
  return bits;
}

/// Opacity of a fragment, interpolated on the lattice.
FN float opacity_at(Floats opacity, uvec4 texture_row, LatticeCell cell) {
  const uint base = texture_row.x;
  return lattice_mix(cell, opacity.v[base + cell.i0], opacity.v[base + cell.i1], opacity.v[base + cell.i2]);
}
