// Edge gradients for vertices (Pidhorskyi et al. 2024, as used by DiffSoup, section 4): what moving a triangle would change
// where neighbouring pixels differ. Needs coverage.h.

/// dL / d(clip coordinates) of a triangle's three vertices.
struct ClipGradient {
  vec4 g0, g1, g2;
};

/// A force on the NDC position of the point with weights s0, s1, s2.
FN void apply_force(vec4 p0, vec4 p1, vec4 p2, real s0, real s1, real s2, vec3 force, INOUT(ClipGradient) gradient) {
  const vec4 point = s0 * p0 + s1 * p1 + s2 * p2;
  const vec3 f = force / point.w;
  const vec4 g = vec4(f.x, f.y, f.z, -(f.x * point.x + f.y * point.y + f.z * point.z) / point.w);
  gradient.g0 += s0 * g;
  gradient.g1 += s1 * g;
  gradient.g2 += s2 * g;
}

FN vec3 to_ndc(vec4 p) { return vec3(p.x / p.w, p.y / p.w, p.z / p.w); }

/// Normal of a triangle in NDC, of any length.
FN vec3 ndc_normal(vec4 p0, vec4 p1, vec4 p2) {
  const vec3 a = to_ndc(p1) - to_ndc(p0), b = to_ndc(p2) - to_ndc(p0);
  return vec3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}

/// How the line in which A and B meet moves with A: the force along the pixels' axis becomes one along A's normal in the plane
/// of that axis and z. n_a, n_b: (axis, z) components of the NDC normals. Zero where the planes are parallel.
FN vec2 intersection_force(vec2 n_a, vec2 n_b, real force) {
  const real length_a = sqrt(dot(n_a, n_a)), length_b = sqrt(dot(n_b, n_b));
  if (length_a == real(0) || length_b == real(0)) return vec2(0);
  const vec2 a = n_a / length_a, b = n_b / length_b;
  const real sine = b.x * a.y - b.y * a.x;
  if (abs(sine) <= real(1e-12)) return vec2(0);
  return a * (force * -b.y / sine);
}

/// If the segment p-q meets the edge from vertex i to vertex j: the force goes to the two ends by perspective-correct weights.
FN bool silhouette_edge(vec4 vi, vec4 vj, vec2 p, vec2 q, OUT(real) si, OUT(real) sj) {
  const vec2 e = vec2(vi.x / vi.w, vi.y / vi.w);
  const vec2 r = vec2(vj.x / vj.w, vj.y / vj.w) - e;
  const vec2 d = q - p;
  si = sj = real(0);
  const real den = cross2(d, r);
  if (den == real(0)) return false;
  const real t = cross2(e - p, r) / den;
  const real u = cross2(e - p, d) / den;
  if (!(t >= real(0) && t <= real(1) && u >= real(0) && u <= real(1))) return false;
  const real wi = (real(1) - u) / vi.w, wj = u / vj.w;
  si = wi / (wi + wj);
  sj = wj / (wi + wj);
  return true;
}

#define EDGE_NONE 0
#define EDGE_INTERIOR 1      // both pixels show A
#define EDGE_INTERSECTION 2  // A and B pass through each other between the pixels
#define EDGE_OPACITY 3       // A covers q but lets it see what is behind
#define EDGE_SILHOUETTE 4    // A ends between the pixels

/// The force between pixel p, which shows triangle A at depth_p, and its neighbour q, on A's vertices; returns the EDGE_ kind.
/// q shows A (q_same), nothing (q_empty) or B at depth_q. force: adjoint * (W/2, 0) * dx or (0, H/2) * dy in NDC, where
/// adjoint = sum_c (g_p + g_q)_c (C_p - C_q)_c / 2 and g = dL/dC.
FN int edge_force(vec4 a0, vec4 a1, vec4 a2, vec4 b0, vec4 b1, vec4 b2, bool q_same, bool q_empty, real depth_p, real depth_q,
                  vec2 p, vec2 q, vec2 force, bool horizontal, INOUT(ClipGradient) gradient) {
  const vec2 middle = real(0.5) * (p + q);
  const vec3 plain = vec3(force.x, force.y, real(0));
  if (q_same) {
    const PlanePoint m = plane_point(a0, a1, a2, middle);
    apply_force(a0, a1, a2, m.b0, m.b1, m.b2, plain, gradient);
    return EDGE_INTERIOR;
  }
  const PlanePoint aq = plane_point(a0, a1, a2, q);
  if (aq.inside) {
    if (!q_empty && depth_q < aq.depth) {
      // B hides A at q. Unless A hides B at p in turn, what lies between them is B's edge, not A's.
      const PlanePoint bp = plane_point(b0, b1, b2, p);
      if (!(bp.inside && depth_p < bp.depth)) return EDGE_NONE;
      const vec3 n_a = ndc_normal(a0, a1, a2), n_b = ndc_normal(b0, b1, b2);
      const vec2 f = horizontal ? intersection_force(vec2(n_a.x, n_a.z), vec2(n_b.x, n_b.z), force.x)
                                : intersection_force(vec2(n_a.y, n_a.z), vec2(n_b.y, n_b.z), force.y);
      const PlanePoint m = plane_point(a0, a1, a2, middle);
      apply_force(a0, a1, a2, m.b0, m.b1, m.b2, horizontal ? vec3(f.x, real(0), f.y) : vec3(real(0), f.x, f.y), gradient);
      return EDGE_INTERSECTION;
    }
    if (q_empty || depth_p < depth_q) {
      const PlanePoint m = plane_point(a0, a1, a2, middle);
      apply_force(a0, a1, a2, m.b0, m.b1, m.b2, plain, gradient);
      return EDGE_OPACITY;
    }
    return EDGE_NONE;
  }
  if (!(q_empty || depth_p < depth_q)) return EDGE_NONE;
  real si, sj;
  if (silhouette_edge(a0, a1, p, q, si, sj)) apply_force(a0, a1, a2, si, sj, real(0), plain, gradient);
  else if (silhouette_edge(a1, a2, p, q, si, sj)) apply_force(a0, a1, a2, real(0), si, sj, plain, gradient);
  else if (silhouette_edge(a2, a0, p, q, si, sj)) apply_force(a0, a1, a2, sj, real(0), si, plain, gradient);
  else return EDGE_NONE;
  return EDGE_SILHOUETTE;
}
