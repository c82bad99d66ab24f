// Finds what lies under a pixel.
import { add, cross, dot, times } from "./vectors.js";

/** Point at a place of the image: eye + depth x (what it returns) lies at the depth along the viewing axis. */
export function rayThrough(view, x, y) {
  const towards = add(add(view.ray, view.rayX, (2 * x) / view.width - 1), view.rayY, (2 * y) / view.height - 1);
  return times(towards, -1);
}

/**
 * Where a ray meets the plane of a triangle, normalised coordinates; null if they are parallel or it is behind the eye.
 * @param {Float32Array} vertices of the model
 * @param {number} triangle from 0
 */
export function pointOnTriangle(vertices, triangle, eye, ray) {
  const [a, b, c] = [0, 3, 6].map((at) => [...vertices.subarray(9 * triangle + at, 9 * triangle + at + 3)]);
  const normal = cross(add(b, a, -1), add(c, a, -1)), slope = dot(normal, ray);
  const depth = dot(normal, add(a, eye, -1)) / slope;
  return depth > 0 && Number.isFinite(depth) ? add(eye, ray, depth) : null;
}
