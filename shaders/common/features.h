// Inputs of the MLP: features of a visible fragment and the view direction.
#include "common/fragment_features.h"

/// Returns the unit vector from the surface at NDC depth z towards the camera, or towards the eye beside it from which
/// this view is shaded.
FN vec3 view_direction(Views views, uint view, uvec2 pixel, uint width, uint height, float z) {
  const vec2 ndc = pixel_ndc(pixel.x, pixel.y, width, height);
  const vec3 ray = vec3(views.v[view].ray + ndc.x * views.v[view].ray_x + ndc.y * views.v[view].ray_y);
  const float inverse_w = views.v[view].inverse_w + z * views.v[view].inverse_w_by_z;
  return normalize(ray + inverse_w * vec3(views.v[view].eye_shift));
}

/// The visible fragments of a thread's pixels `first` to first + PIXELS - 1 (of four) and the MLP's inputs for them,
/// zero where nothing is visible.
struct Fragments {
  bool inside[PIXELS];    // inside the image
  uint index[PIXELS];     // in the batch buffers
  uint triangle[PIXELS];  // index + 1; 0: none
  uint lattice_offset[PIXELS];
  LatticeCell cell[PIXELS];
};

FN void load_fragments(Views views, uint view, uvec2 corner, uint thread, uint first, Hits hits, OUT(Fragments) p) {
  const uint width = views.v[view].width, height = views.v[view].height, offset = views.v[view].pixel_offset;
  UNROLL for (uint k = 0u; k < PIXELS; ++k) {
    const uvec2 at = block_pixel(corner, thread, first + k);
    p.inside[k] = at.x < width && at.y < height;
    p.index[k] = offset + at.y * width + at.x;
    p.triangle[k] = 0u;
    if (p.inside[k]) p.triangle[k] = hits.v[p.index[k]].triangle;
  }
}

#ifdef LANES_OF_A_CPU
FN void ask_for(const vec4 words) {}  // a value that is read but not used is only prefetched (engine/gpu/lanes)
/// Prefetches the samples that mlp_inputs will read for the thread's pixel `first` while the previous pixel is shaded.
/// Triangles lie anywhere in memory, and a lane that waits for its texture stalls all lanes.
FN void ask_for_features(Views views, uint view, uvec2 corner, uint thread, uint first, Hits hits, Textures textures,
                         Float4s lattice) {
  if (first >= 4u) return;
  Fragments p;
  load_fragments(views, view, corner, thread, first, hits, p);
  if (p.triangle[0] == 0u) return;
  const uint offset = textures.v[p.triangle[0] - 1u].lattice_offset;
  const LatticeCell cell =
      lattice_cell(hits.v[p.index[0]].b0, hits.v[p.index[0]].b1, textures.v[p.triangle[0] - 1u].level_max);
  ask_for(lattice.v[(offset + cell.i0) * 2u]);
  ask_for(lattice.v[(offset + cell.i1) * 2u]);
  ask_for(lattice.v[(offset + cell.i2) * 2u]);
}
#define ASK_FOR_FEATURES(first) ask_for_features(a.views, view, corner, thread, first, a.hits, a.textures, a.lattice)
#else
#define ASK_FOR_FEATURES(first)
#endif

FN void mlp_inputs(Views views, uint view, uvec2 corner, uint thread, uint first, Hits hits, Textures textures,
                   Float4s lattice, bool coarser, INOUT(Fragments) p, OUT_ARRAY_OF(LANES, x, 16)) {
  UNROLL for (int i = 0; i < 16; ++i) x[i] = LANES(0.0f);
  const uint width = views.v[view].width, height = views.v[view].height;
  UNROLL for (uint k = 0u; k < PIXELS; ++k) if (p.triangle[k] != 0u) {
    p.lattice_offset[k] = textures.v[p.triangle[k] - 1u].lattice_offset;
    const float b0 = hits.v[p.index[k]].b0, b1 = hits.v[p.index[k]].b1;
    const uint level = textures.v[p.triangle[k] - 1u].level_max;
    if (coarser)
      p.cell[k] = coarser_cell(b0, b1, level);
    else
      p.cell[k] = lattice_cell(b0, b1, level);
    float f[7], y[9];
    fragment_features(lattice, p.lattice_offset[k], p.cell[k], f);
    const uvec2 pixel = block_pixel(corner, thread, first + k);
    spherical_harmonics(view_direction(views, view, pixel, width, height, hits.v[p.index[k]].depth), y);
    UNROLL for (uint i = 0u; i < 7u; ++i) LANE(x[i], k) = f[i];
    UNROLL for (uint i = 0u; i < 9u; ++i) LANE(x[7u + i], k) = y[i];
  }
}
