// The point of the soup that a pixel shows.

/// triangle: index + 1, not 0. b0, b1: of the Hit.
FN vec3 surface_point(Floats vertices, uint triangle, float b0, float b1) {
  const uint at = (triangle - 1u) * 9u;
  const vec3 v0 = vec3(vertices.v[at], vertices.v[at + 1u], vertices.v[at + 2u]);
  const vec3 v1 = vec3(vertices.v[at + 3u], vertices.v[at + 4u], vertices.v[at + 5u]);
  const vec3 v2 = vec3(vertices.v[at + 6u], vertices.v[at + 7u], vertices.v[at + 8u]);
  return v2 + b0 * (v0 - v2) + b1 * (v1 - v2);
}
