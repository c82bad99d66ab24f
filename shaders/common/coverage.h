// Projection and coverage (DiffSoup, section 4; homogeneous rasterisation after Olano and Greer, 1997). Several kernels
// compute coverage and depth and must agree to the last bit, hence PRECISE. Clip space is OpenGL's: NDC x, y, z in [-1,
// 1], w > 0 in front of the camera.
#ifdef KERNEL_CONTRACTED
#error "compiled with products and sums contracted, in which no two kernels need to agree: see engine/CMakeLists.txt"
#endif

FN real cross2(vec2 a, vec2 b) { return a.x * b.y - a.y * b.x; }

// Points behind the camera. M is the matrix whose rows are (x, y, w) of a triangle's corners. The weights l with l0
// (x0, y0, w0) + l1 (..) + l2 (..) = (ndc, 1) are linear in ndc: the edge functions divided by det M. The point of the
// triangle's plane seen at ndc has barycentrics l / sum(l) and w = 1 / sum(l). In the triangle, all l are >= 0 in front
// of the camera and <= 0 behind it, and never all 0. With the sign of det M applied, edge functions are therefore all
// >= 0 with a positive sum exactly in front of the camera, wherever the corners lie, and no triangle needs to be
// clipped (Olano and Greer). If the triangle is seen edge-on, rounding can flip the sign of det M. Depth then rejects
// the fragment: perspective depth (f + n) / (f - n) - 2 f n / ((f - n) w) is above 1 for w < 0 and below -1 for 0 < w <
// n.

/// Edge functions of a triangle at an NDC point: barycentrics times their sum. Without the sign of det M, so they are
/// negative inside for one winding.
FN vec3 edge_values(vec4 p0, vec4 p1, vec4 p2, vec2 ndc) {
  const vec2 q0 = vec2(p0.x - ndc.x * p0.w, p0.y - ndc.y * p0.w);
  const vec2 q1 = vec2(p1.x - ndc.x * p1.w, p1.y - ndc.y * p1.w);
  const vec2 q2 = vec2(p2.x - ndc.x * p2.w, p2.y - ndc.y * p2.w);
  return vec3(cross2(q1, q2), cross2(q2, q0), cross2(q0, q1));
}

/// Intersection of the ray of an NDC point with the plane of a triangle.
struct PlanePoint {
  real b0, b1, b2;  // perspective-correct barycentrics
  real depth;       // NDC z
  real w;           // clip w
  bool inside;      // the triangle covers the point in front of the camera (either winding, depth range not tested)
};

/// p0, p1, p2: clip coordinates.
FN PlanePoint plane_point(vec4 p0, vec4 p1, vec4 p2, vec2 ndc) {
  const vec3 a = edge_values(p0, p1, p2, ndc);
  const real sum = a.x + a.y + a.z;
  PlanePoint point;
  point.inside = false;
  point.b0 = point.b1 = point.b2 = point.depth = point.w = real(0);
  if (sum == real(0)) return point;
  point.b0 = a.x / sum;
  point.b1 = a.y / sum;
  point.b2 = a.z / sum;
  point.w = point.b0 * p0.w + point.b1 * p1.w + point.b2 * p2.w;
  point.depth = (point.b0 * p0.z + point.b1 * p1.z + point.b2 * p2.z) / point.w;
  point.inside = point.b0 >= real(0) && point.b1 >= real(0) && point.b0 + point.b1 <= real(1) && point.w > real(0);
  return point;
}

/// Returns the NDC area the triangle would have if its scale were that at the covered point with barycentrics b0, b1
/// everywhere. The NDC derivative of barycentrics at clip w is w^3 / det M; the area is half of its inverse. NaN at w =
/// 0. det M is the same for any origin; an origin near the triangle keeps small triangles precise in float.
FN real area_at(vec4 p0, vec4 p1, vec4 p2, vec2 origin, real b0, real b1) {
  const vec3 a = edge_values(p0, p1, p2, origin);
  const real det = a.x * p0.w + a.y * p1.w + a.z * p2.w;
  const real w = b0 * p0.w + b1 * p1.w + (real(1) - b0 - b1) * p2.w;
  return real(0.5) * abs(det / (w * w * w));
}

/// A triangle as linear functions of the offset d from an NDC point `origin`: edge k is e_k.x + d.x e_k.y + d.y e_k.z,
/// all >= 0 inside; barycentrics are edge_k over their sum; depth is plane.x + d.x plane.y + d.y plane.z. An origin
/// near the pixels keeps small triangles precise in float. valid is false if the triangle has no area on the screen, or
/// if float cannot determine which side is seen: points behind the camera could then pass as covered.
struct TriangleSetup {
  vec3 e0, e1, e2, plane;
  bool valid;
};

FN vec3 edge_function(vec2 q, real w, vec2 r, real v) {
  PRECISE vec3 edge = vec3(q.x * r.y - q.y * r.x, q.y * v - w * r.y, w * r.x - q.x * v);
  return edge;
}

FN TriangleSetup triangle_setup(vec4 p0, vec4 p1, vec4 p2, vec2 origin) {
  const PRECISE vec2 q0 = vec2(p0.x - origin.x * p0.w, p0.y - origin.y * p0.w);
  const PRECISE vec2 q1 = vec2(p1.x - origin.x * p1.w, p1.y - origin.y * p1.w);
  const PRECISE vec2 q2 = vec2(p2.x - origin.x * p2.w, p2.y - origin.y * p2.w);
  PRECISE TriangleSetup setup;
  setup.e0 = edge_function(q1, p1.w, q2, p2.w);
  setup.e1 = edge_function(q2, p2.w, q0, p0.w);
  setup.e2 = edge_function(q0, p0.w, q1, p1.w);
  // det M, the sum of edge_k w_k, does not depend on the point.
  const PRECISE real det = setup.e0.x * p0.w + setup.e1.x * p1.w + setup.e2.x * p2.w;
  const real terms = (abs(q1.x * q2.y) + abs(q1.y * q2.x)) * abs(p0.w) +
                     (abs(q2.x * q0.y) + abs(q2.y * q0.x)) * abs(p1.w) +
                     (abs(q0.x * q1.y) + abs(q0.y * q1.x)) * abs(p2.w);
  // The relative rounding error of the six products and their sums is at most 2.1e-7.
  setup.valid = abs(det) > real(1e-6) * terms;
  setup.plane = vec3(0);
  if (setup.valid) {
    setup.plane = (setup.e0 * p0.z + setup.e1 * p1.z + setup.e2 * p2.z) / det;
    if (det < real(0)) {
      setup.e0 = -setup.e0;
      setup.e1 = -setup.e1;
      setup.e2 = -setup.e2;
    }
  }
  return setup;
}

FN real at_offset(vec3 linear, vec2 d) {
  PRECISE real value = linear.x + d.x * linear.y + d.y * linear.z;
  return value;
}
