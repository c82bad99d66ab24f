// Edge gradients of vertices (Pidhorskyi et al. 2024, as used by DiffSoup, section 4): the effect of moving a triangle
// on the differences between neighbouring pixels. Needs coverage.h.

/// dL / d(clip coordinates) of a triangle's three vertices.
struct ClipGradient {
  vec4 g0, g1, g2;
};

/// Applies a force to the NDC position of the point with weights s0, s1, s2.
FN void apply_force(vec4 p0, vec4 p1, vec4 p2, real s0, real s1, real s2, vec3 force, INOUT(ClipGradient) gradient) {
  const vec4 point = s0 * p0 + s1 * p1 + s2 * p2;
  // Visible points are in front of the camera, but rounding with distant corners can give w <= 0.
  if (!(point.w > real(0))) return;
  const vec3 f = force / point.w;
  const vec4 g = vec4(f.x, f.y, f.z, -(f.x * point.x + f.y * point.y + f.z * point.z) / point.w);
  gradient.g0 += s0 * g;
  gradient.g1 += s1 * g;
  gradient.g2 += s2 * g;
}

/// Returns a normal of a triangle in NDC, not normalised, with either sign. Corners may be behind the camera. NDC depth
/// is a linear function of the screen position, and its graph is the triangle's plane. origin: an NDC point close to
/// where the normal is used.
FN vec3 ndc_normal(vec4 p0, vec4 p1, vec4 p2, vec2 origin) {
  const TriangleSetup setup = triangle_setup(p0, p1, p2, origin);
  return vec3(setup.plane.y, setup.plane.z, real(-1));
}

/// Force on the intersection line of A and B as A moves. Converts the force along the pixel axis to a force along A's
/// normal in the plane of that axis and z. n_a, n_b: (axis, z) components of the NDC normals. Zero if the planes are
/// parallel.
FN vec2 intersection_force(vec2 n_a, vec2 n_b, real force) {
  const real length_a = sqrt(dot(n_a, n_a)), length_b = sqrt(dot(n_b, n_b));
  if (length_a == real(0) || length_b == real(0)) return vec2(0);
  const vec2 a = n_a / length_a, b = n_b / length_b;
  const real sine = b.x * a.y - b.y * a.x;
  if (abs(sine) <= real(1e-12)) return vec2(0);
  return a * (force * -b.y / sine);
}

/// Finds the point where the segment from p, which the triangle covers, to q, which it does not, leaves the triangle.
/// s: the vertices' weights there; 0 for the vertex opposite the crossed edge. Corners may be behind the camera,
/// because edge functions are linear on the screen. crosses: the near plane cuts the triangle. Returns false if the
/// segment meets the near plane first: the triangle continues beyond it.
FN bool silhouette_point(vec4 p0, vec4 p1, vec4 p2, bool crosses, vec2 p, vec2 q, OUT(vec3) s) {
  vec3 at_p = edge_values(p0, p1, p2, p), at_q = edge_values(p0, p1, p2, q);
  s = vec3(0);
  if (at_p.x + at_p.y + at_p.z < real(0)) {
    at_p = -at_p;
    at_q = -at_q;
  }
  real first = real(2);
  int edge = -1;
  UNROLL for (int k = 0; k < 3; ++k) {
    if (!(at_q[k] < real(0))) continue;
    const real inside = max(at_p[k], real(0)), t = inside / (inside - at_q[k]);
    if (t < first) {
      first = t;
      edge = k;
    }
  }
  if (edge < 0) return false;
  if (crosses) {
    const vec3 above = vec3(p0.z + p0.w, p1.z + p1.w, p2.z + p2.w);
    const real near_p = max(dot(at_p, above), real(0)), near_q = dot(at_q, above);
    if (near_q < real(0) && near_p <= first * (near_p - near_q)) return false;
  }
  const vec3 at_edge = max(at_p + first * (at_q - at_p), vec3(0));
  s = vec3(edge == 0 ? real(0) : at_edge.x, edge == 1 ? real(0) : at_edge.y, edge == 2 ? real(0) : at_edge.z);
  const real sum = s.x + s.y + s.z;
  if (!(sum > real(0))) return false;
  s /= sum;
  return true;
}

#define EDGE_NONE 0
#define EDGE_INTERIOR 1      // both pixels show A
#define EDGE_INTERSECTION 2  // A and B intersect between the pixels
#define EDGE_OPACITY 3       // A covers q but is transparent there
#define EDGE_SILHOUETTE 4    // A ends between the pixels

/// Adds the force between pixel p, which shows triangle A at depth_p, and its neighbour q to A's vertices. Returns the
/// EDGE_ kind. q shows A (q_same), nothing (q_empty) or B at depth_q. force: adjoint * (W/2, 0) * dx or (0, H/2) * dy
/// in NDC, where adjoint = sum_c (g_p + g_q)_c (C_p - C_q)_c / 2 and g = dL/dC. a_crosses: the near plane cuts A. The
/// cut is not an edge: moving A there changes what the near plane cuts off, not what A shows.
FN int edge_force(vec4 a0, vec4 a1, vec4 a2, vec4 b0, vec4 b1, vec4 b2, bool a_crosses, bool q_same, bool q_empty,
                  real depth_p, real depth_q, vec2 p, vec2 q, vec2 force, bool horizontal,
                  INOUT(ClipGradient) gradient) {
  const vec2 middle = real(0.5) * (p + q);
  vec3 s = vec3(0), applied = vec3(force.x, force.y, real(0));
  int kind = EDGE_NONE;
  if (q_same) {
    kind = EDGE_INTERIOR;
  } else {
    const PlanePoint aq = plane_point(a0, a1, a2, q);
    if (aq.inside) {
      if (a_crosses && aq.depth < real(-1)) return EDGE_NONE;
      if (!q_empty && depth_q < aq.depth) {
        // B hides A at q. Unless A also hides B at p, the edge between them belongs to B, not to A.
        const PlanePoint bp = plane_point(b0, b1, b2, p);
        if (!(bp.inside && depth_p < bp.depth)) return EDGE_NONE;
        const vec3 n_a = ndc_normal(a0, a1, a2, middle), n_b = ndc_normal(b0, b1, b2, middle);
        const vec2 f = horizontal ? intersection_force(vec2(n_a.x, n_a.z), vec2(n_b.x, n_b.z), force.x)
                                  : intersection_force(vec2(n_a.y, n_a.z), vec2(n_b.y, n_b.z), force.y);
        applied = horizontal ? vec3(f.x, real(0), f.y) : vec3(real(0), f.x, f.y);
        kind = EDGE_INTERSECTION;
      } else if (q_empty || depth_p < depth_q) {
        kind = EDGE_OPACITY;
      }
    } else if ((q_empty || depth_p < depth_q) && silhouette_point(a0, a1, a2, a_crosses, p, q, s)) {
      kind = EDGE_SILHOUETTE;
    }
  }
  if (kind == EDGE_NONE) return EDGE_NONE;
  if (kind != EDGE_SILHOUETTE) {
    const PlanePoint m = plane_point(a0, a1, a2, middle);
    s = vec3(m.b0, m.b1, m.b2);
  }
  apply_force(a0, a1, a2, s.x, s.y, s.z, applied, gradient);
  return kind;
}
