// Multi-view stereo by PatchMatch with slanted planes (Bleyer, Rhemann, Rother 2011; Galliani, Lasinger, Schindler
// 2015, with the sampling of Xu and Tao 2019). The plane of a pixel is its inverse depth w and the change of w per
// pixel along x and y. Inverse depth is linear in the pixel along a plane in space, and the pixel where another view
// sees a point is a ratio of linear functions of (x, y, 1, w) (StereoPair). Both together make the patch's homography
// cheap.

/// Costs are 1 - normalised cross-correlation; this one means that the views cannot be compared.
const float kNoMatch = 2.0f;
/// The other view does not show the patch.
const float kNotShown = 3.0f;
const int kPatchSamples = 25, kPatchReach = 3;

/// Sample k of a patch: every other pixel of 7 x 7, like a checkerboard.
FN int patch_x(int k) { return int(2u * uint(k) % 7u) - 3; }
FN int patch_y(int k) { return int(2u * uint(k) / 7u) - 3; }

/// A plane at the pixel (dx, dy) away from where it was given.
FN vec3 plane_moved(vec3 plane, float dx, float dy) {
  return vec3(plane.x + plane.y * dx + plane.z * dy, plane.y, plane.z);
}

/// Homogeneous pixel in the other view of the point at pixel centre (x, y) with inverse depth w. Its third component is
/// the depth there relative to the depth here; without a point in front of the other camera it is not positive.
FN vec3 transferred(vec4 row_x, vec4 row_y, vec4 row_z, float x, float y, float w) {
  const vec4 p = vec4(x, y, 1.0f, w);
  return vec3(dot(row_x, p), dot(row_y, p), dot(row_z, p));
}
