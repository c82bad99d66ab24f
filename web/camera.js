// Cameras: projection and framing of a soup (as in engine/scene/camera.cpp and engine/render/cameras.cpp). Normalised
// coordinates; angles in radians.
import { add, cross, dot, length, normalize, times } from "./vectors.js";

/**
 * @typedef {object} Camera pinhole camera with OpenCV axes: x right, y down, z forward. The centre of pixel (i, j) is
 *   at (i + 0.5, j + 0.5); row 0 is the top row.
 * @property {string} [name] name of its photograph
 * @property {boolean} [test]
 * @property {number} width pixels
 * @property {number} height
 * @property {number} fx focal length in pixels, like fy; cx, cy: principal point
 * @property {number} fy
 * @property {number} cx
 * @property {number} cy
 * @property {number[]} pose world to camera, 3 x 4, row-major; rigid
 * @property {number} [distance] from the eye to the point that it orbits, if known
 * @property {boolean} [free] true unless it is one of the model's
 */

export const row = (camera, i) => camera.pose.slice(4 * i, 4 * i + 3);
export const forward = (camera) => row(camera, 2);
/** Rotates a direction from camera to world axes. The inverse of a rotation is its transpose. */
const toWorld = (camera, d) => add(add(times(row(camera, 0), d[0]), row(camera, 1), d[1]), row(camera, 2), d[2]);
export const centre = (camera) => times(toWorld(camera, [camera.pose[3], camera.pose[7], camera.pose[11]]), -1);

/** A camera with square pixels and a centred principal point. fov: vertical. */
export function lookAt(eye, target, up, fov, width, height) {
  const focal = (0.5 * height) / Math.tan(0.5 * fov);
  const z = normalize(add(target, eye, -1)), x = normalize(cross(z, up)), y = cross(z, x);
  const pose = [x, y, z].flatMap((axis) => [...axis, -dot(axis, eye)]);
  return { width, height, fx: focal, fy: focal, cx: 0.5 * width, cy: 0.5 * height, pose };
}

/** The camera for another image size. The vertical field of view and the centre of the image stay the same. */
export function reshaped(camera, width, height) {
  const s = height / camera.height;
  return {
    ...camera, width, height, fx: camera.fx * s, fy: camera.fy * s,
    cx: 0.5 * width + s * (camera.cx - 0.5 * camera.width), cy: camera.cy * s,
  };
}

/**
 * The camera for another image size, as `reshaped`, but never with a smaller horizontal field of view: on a phone held
 * upright nothing is cut off at the sides.
 */
export function fitted(camera, width, height) {
  const s = width / camera.width;
  if (s * camera.height >= height) return reshaped(camera, width, height);
  return { ...camera, width, height, fx: camera.fx * s, fy: camera.fy * s, cx: camera.cx * s,
    cy: 0.5 * height + s * (camera.cy - 0.5 * camera.height) };
}

/** Vertical field of view. */
export const fovOf = (camera) => 2 * Math.atan((0.5 * camera.height) / camera.fy);
/** Width / height of its image if its pixels were squares. */
export const aspectOf = (camera) => (camera.width / camera.fx) / (camera.height / camera.fy);

/**
 * @typedef {object} View a camera in the form that the renderer needs. NDC y points down, like the rows of the image.
 * @property {number} width pixels
 * @property {number} height
 * @property {Float32Array} clipFromWorld world to OpenGL clip space, column-major
 * @property {number[]} eye world coordinates
 * @property {number[]} ray direction from the surface to the camera at NDC (x, y): ray + x rayX + y rayY, not
 *   normalised
 * @property {number[]} rayX
 * @property {number[]} rayY
 */

/** @returns {View} */
export function viewOf(camera, near, far) {
  const { width, height, pose } = camera;
  // clip = (ax x + bx z, ay y + by z, az z + bz, z) for (x, y, z) in camera axes.
  const ax = (2 * camera.fx) / width, ay = (2 * camera.fy) / height;
  const bx = (2 * camera.cx) / width - 1, by = (2 * camera.cy) / height - 1;
  const az = (far + near) / (far - near), bz = (-2 * far * near) / (far - near);
  const clipFromWorld = new Float32Array(16);
  for (let column = 0; column < 4; ++column) {
    const [x, y, z] = [pose[column], pose[4 + column], pose[8 + column]];
    clipFromWorld.set([ax * x + bx * z, ay * y + by * z, az * z + (column === 3 ? bz : 0), z], 4 * column);
  }
  return {
    width, height, clipFromWorld, eye: centre(camera), ray: toWorld(camera, [bx / ax, by / ay, -1]),
    rayX: toWorld(camera, [-1 / ax, 0, 0]), rayY: toWorld(camera, [0, -1 / ay, 0]),
  };
}

/** Mean up direction of the cameras, unit length; +Y if they cancel out or there are none. */
function meanUp(cameras) {
  const sum = cameras.reduce((up, camera) => add(up, row(camera, 1), -1), [0, 0, 0]);
  return cameras.length > 0 && length(sum) > 1e-3 * cameras.length ? normalize(sum) : [0, 1, 0];
}

/** The box of the vertices without the fraction `leftOut` at both ends of each axis: soups have outliers. */
function innerBox(vertices, leftOut) {
  const count = vertices.length / 3, left = Math.floor(leftOut * (count - 1));
  const axes = [0, 1, 2].map((axis) => Float32Array.from({ length: count }, (_, i) => vertices[3 * i + axis]).sort());
  return { low: axes.map((values) => values[left]), high: axes.map((values) => values[count - 1 - left]) };
}

/**
 * Target, up direction, distance, field of view and its aspect with which the whole soup is in view.
 * @param {import("./model.js").Model} model
 */
export function framingOf(model) {
  const { cameras } = model, up = model.up ?? meanUp(cameras);
  if (cameras.length > 0) {
    // In normalised coordinates the cameras surround the origin at mean distance 1.
    const mean = (value) => cameras.reduce((sum, camera) => sum + value(camera), 0) / cameras.length;
    const distance = Math.max(1e-3, mean((camera) => length(centre(camera))));
    return { target: [0, 0, 0], up, distance, fov: mean(fovOf), aspect: mean(aspectOf) };
  }
  const { low, high } = innerBox(model.vertices, 0.05), fov = 0.7;
  return { target: times(add(low, high), 0.5), up,
    distance: Math.max(1e-3, (0.65 * length(add(high, low, -1))) / Math.tan(0.5 * fov)), fov, aspect: 1 };
}

/** Two unit vectors that form a right-handed basis with the unit vector `up`. */
export function groundAxes(up) {
  const x = normalize(cross(Math.abs(up[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0], up));
  return [x, cross(up, x)];
}

/** Unit vector with this azimuth and elevation above the ground. axes: groundAxes(up) */
export const direction = ([x, y], up, azimuth, elevation) =>
  add(times(add(times(x, Math.cos(azimuth)), y, Math.sin(azimuth)), Math.cos(elevation)), up, Math.sin(elevation));

/**
 * Cameras on a Fibonacci lattice of the upper hemisphere, as in soup-view --benchmark.
 * @param {ReturnType<typeof framingOf>} framing
 * @param {number} count
 * @param {number} width pixels
 * @param {number} height
 * @returns {Camera[]}
 */
export function hemisphere({ target, up, distance, fov }, count, width, height) {
  const axes = groundAxes(up), goldenAngle = Math.PI * (3 - Math.sqrt(5));
  return Array.from({ length: count }, (_, i) => {
    const elevation = Math.asin((i + 0.5) / count), towards = direction(axes, up, goldenAngle * i, elevation);
    // Looking straight down, any horizontal direction can be up.
    return lookAt(add(target, towards, distance), target, Math.abs(Math.sin(elevation)) > 0.9999 ? axes[1] : up, fov,
      width, height);
  });
}
