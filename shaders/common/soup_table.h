// A triangle's data for fragment shaders: a column of three texels in the table made by render::upload_model.

layout(binding = 1) uniform usampler2DArray soup_table;

struct SoupTriangle {
  vec3 v2, e0, e1;   // normalised coordinates; the other corners are v2 + e0 and v2 + e1
  uint place;        // x0 | y0 << 16 in the atlas
  uint layer_level;  // level | page << 8 | turned << 16
};

/// Uses shifts because CPUs have no vector division of integers.
ivec2 table_column(uint triangle) { return ivec2(int(triangle & (kTableWidth - 1u)), int(triangle >> 10)); }

SoupTriangle soup_triangle(uint triangle) {
  const ivec2 column = table_column(triangle);
  const uvec4 a = texelFetch(soup_table, ivec3(column, 0), 0), b = texelFetch(soup_table, ivec3(column, 1), 0);
  const uvec4 c = texelFetch(soup_table, ivec3(column, 2), 0);
  return SoupTriangle(uintBitsToFloat(a.xyz), uintBitsToFloat(b.xyz), uintBitsToFloat(c.xyz), a.w, b.w);
}

/// Direction from the surface to the camera at an NDC position; not normalised.
vec3 to_camera(vec2 ndc) { return frame.ray.xyz + ndc.x * frame.ray_x.xyz + ndc.y * frame.ray_y.xyz; }

/// Barycentrics b0, b1 of the triangle at an NDC position. Computed from the ray, because interpolated values would
/// depend on the corners that the rasteriser has snapped to its grid. With multisampling, a pixel centre may lie
/// outside the triangle and is moved to its edge.
vec2 barycentrics(SoupTriangle t, vec2 ndc) {
  const Barycentrics b = ray_barycentrics(frame.eye.xyz, to_camera(ndc), t.v2, t.e0, t.e1);
  const float b0 = clamp(b.b0, 0.0, 1.0);
  return vec2(b0, clamp(b.b1, 0.0, 1.0 - b0));
}
