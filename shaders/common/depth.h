// Inverse depth of a triangle's plane at a pixel, its error against a depth map, and the gradient by the vertices.
// Needs coverage.h and edges.h.

/// Relative errors of inverse depth below it have a gradient in proportion to them (Huber).
const real kDepthHuber = real(0.02);
/// Planes that pass closer to the camera than this share of their depth at the pixel are seen too flatly to follow.
const real kFlattestPlane = real(0.1);
/// Largest relative difference of inverse depths of one surface in neighbouring pixels of a depth map.
const real kDepthEdge = real(0.1);

/// A triangle's plane seen at an NDC point. With r = (ndc, 1), inverse depth 1 / clip w is dot(normal, r) everywhere on
/// the plane, because dot(normal, (x, y, w)) is 1 at its three corners.
struct DepthPlane {
  vec3 normal;   // by clip x, y and w
  vec3 weights;  // barycentrics times inverse depth
  real inverse;  // inverse depth at the point
  bool valid;    // false: seen edge-on, or behind the camera
};

FN DepthPlane depth_plane(vec4 p0, vec4 p1, vec4 p2, vec2 ndc) {
  const TriangleSetup setup = triangle_setup(p0, p1, p2, ndc);
  DepthPlane plane;
  plane.normal = plane.weights = vec3(0);
  plane.inverse = real(0);
  plane.valid = false;
  if (!setup.valid) return plane;
  const real det = setup.e0.x * p0.w + setup.e1.x * p1.w + setup.e2.x * p2.w;
  plane.weights = vec3(setup.e0.x, setup.e1.x, setup.e2.x) / det;
  const vec3 sum = (setup.e0 + setup.e1 + setup.e2) / det;
  plane.inverse = sum.x;
  plane.normal = vec3(sum.y, sum.z, sum.x - ndc.x * sum.y - ndc.y * sum.z);
  plane.valid = plane.inverse > real(0);
  return plane;
}

/// Huber loss of the relative error of inverse depth; its slope is 1 beyond kDepthHuber. It does not depend on the unit
/// of length. inverse, measured: above 0.
FN real depth_loss(real inverse, real measured) {
  const real error = abs(inverse / measured - real(1));
  return error < kDepthHuber ? real(0.5) * error * error / kDepthHuber : error - real(0.5) * kDepthHuber;
}

/// Derivative of depth_loss by `inverse`.
FN real depth_loss_slope(real inverse, real measured) {
  return clamp((inverse / measured - real(1)) / kDepthHuber, real(-1), real(1)) / measured;
}

/// Adds the gradient of the corners' clip coordinates. slope: derivative of the loss by plane.inverse. If corner k
/// moves by d, the plane follows, and inverse depth changes by -weights[k] dot(normal, d).
FN void add_depth_gradient(IN(DepthPlane) plane, real slope, INOUT(ClipGradient) gradient) {
  const vec4 g = -slope * vec4(plane.normal.x, plane.normal.y, real(0), plane.normal.z);
  gradient.g0 += plane.weights.x * g;
  gradient.g1 += plane.weights.y * g;
  gradient.g2 += plane.weights.z * g;
}

/// Interpolates four neighbouring inverse depths, which are linear along a plane. Returns 0, no measurement, if one of
/// them is 0 or if they are not of one surface. fx, fy: position between them, 0 to 1.
FN real between_depths(real a, real b, real c, real d, real fx, real fy) {
  const real low = min(min(a, b), min(c, d)), high = max(max(a, b), max(c, d));
  if (!(low > real(0)) || high - low > kDepthEdge * high) return real(0);
  return (a + fx * (b - a)) * (real(1) - fy) + (c + fx * (d - c)) * fy;
}
