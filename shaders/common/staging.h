// A tile's list of triangles, brought into shared memory 64 at a time as edge functions about the tile's middle.
SHARED vec4 s_e0[64], s_e1[64], s_e2[64], s_plane[64];
SHARED uvec4 s_texture[64];  // lattice offset, level, triangle

FN void stage_triangle(uint slot, uint triangle, ScreenTriangles screen, uint first, Textures textures, vec2 origin) {
  const uint at = first + triangle;
  const TriangleSetup setup = triangle_setup(screen.v[at].p0, screen.v[at].p1, screen.v[at].p2, origin);
  // What has no area on the screen covers nothing.
  s_e0[slot] = vec4(setup.valid ? setup.e0 : vec3(-1.0f, 0.0f, 0.0f), 0.0f);
  s_e1[slot] = vec4(setup.e1, 0.0f);
  s_e2[slot] = vec4(setup.e2, 0.0f);
  s_plane[slot] = vec4(setup.plane, 0.0f);
  s_texture[slot] = uvec4(textures.v[triangle].lattice_offset, textures.v[triangle].level_max, triangle, 0u);
}

/// Bit k: the staged triangle first + k covers the pixel at offset d nearer than `limit`, or as near and of an index
/// below `index_end`: equal depths go to the lower index. At most 32, up to slot `end`. Only arithmetic, the same for
/// all pixels: each then goes on with its own few fragments, which is where memory is read. A test inside one loop
/// would read for every triangle of the list that any pixel of a SIMD group is covered by, or, where a branch is a mask
/// (llvmpipe), for all of them.
FN uint covering(uint first, uint end, vec2 d, float limit, uint index_end) {
  uint bits = 0u;
  for (uint k = first; k < min(first + 32u, end); ++k) {
    const float e0 = at_offset(vec3(s_e0[k]), d), e1 = at_offset(vec3(s_e1[k]), d), e2 = at_offset(vec3(s_e2[k]), d);
    const float depth = at_offset(vec3(s_plane[k]), d);
    // Without && and ?:, which are branches, and none that anybody foresees.
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
