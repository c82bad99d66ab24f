// Barycentrics of the intersection of a ray and a triangle's plane (Moeller and Trumbore, 1997), in any space in which
// rays are straight.

struct Barycentrics {
  real b0, b1;  // of the corners v2 + e0 and v2 + e1
};

/// e0, e1: the other two corners minus v2. direction: any length, either sign. Returns 0, 0 if the ray is parallel to
/// the plane.
FN Barycentrics ray_barycentrics(vec3 eye, vec3 direction, vec3 v2, vec3 e0, vec3 e1) {
  const vec3 t = eye - v2, p = cross(direction, e1);
  const real det = dot(p, e0), scale = det != real(0) ? real(1) / det : real(0);
  Barycentrics b;
  b.b0 = dot(p, t) * scale;
  b.b1 = dot(cross(t, e0), direction) * scale;
  return b;
}
