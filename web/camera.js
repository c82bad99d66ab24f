// Cameras: projection, framing of a soup, navigation (as in engine/scene/camera.cpp, engine/render/cameras.cpp and
// viewer/navigation.cpp). Normalised coordinates; angles in radians.

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
 */

const add = (a, b, scale = 1) => [a[0] + scale * b[0], a[1] + scale * b[1], a[2] + scale * b[2]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const length = (a) => Math.hypot(a[0], a[1], a[2]);
const times = (a, scale) => [scale * a[0], scale * a[1], scale * a[2]];
const normalize = (a) => times(a, 1 / length(a));
const clamp = (x, low, high) => Math.min(Math.max(x, low), high);

const row = (camera, i) => camera.pose.slice(4 * i, 4 * i + 3);
const forward = (camera) => row(camera, 2);
/** Rotates a direction from camera to world axes. The inverse of a rotation is its transpose. */
const toWorld = (camera, d) => add(add(times(row(camera, 0), d[0]), row(camera, 1), d[1]), row(camera, 2), d[2]);
const centre = (camera) => times(toWorld(camera, [camera.pose[3], camera.pose[7], camera.pose[11]]), -1);

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
 * Target, up direction, distance and field of view with which the whole soup is in view.
 * @param {import("./model.js").Model} model
 */
export function framingOf(model) {
  const { cameras } = model, up = model.up ?? meanUp(cameras);
  if (cameras.length > 0) {
    // In normalised coordinates the cameras surround the origin at mean distance 1.
    const mean = (value) => cameras.reduce((sum, camera) => sum + value(camera), 0) / cameras.length;
    const distance = Math.max(1e-3, mean((camera) => length(centre(camera))));
    return { target: [0, 0, 0], up, distance, fov: mean((camera) => 2 * Math.atan((0.5 * camera.height) / camera.fy)) };
  }
  const { low, high } = innerBox(model.vertices, 0.05), fov = 0.7;
  return { target: times(add(low, high), 0.5), up,
    distance: Math.max(1e-3, (0.65 * length(add(high, low, -1))) / Math.tan(0.5 * fov)), fov };
}

/** Two unit vectors that form a right-handed basis with the unit vector `up`. */
function groundAxes(up) {
  const x = normalize(cross(Math.abs(up[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0], up));
  return [x, cross(up, x)];
}

/** Unit vector with this azimuth and elevation above the ground. axes: groundAxes(up) */
const direction = ([x, y], up, azimuth, elevation) =>
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

const STEEPEST = 1.55;  // the horizon is undefined when looking straight up or down
const START_AZIMUTH = 0.6, START_ELEVATION = 0.35;

/**
 * A turntable camera that orbits a target and keeps the horizon level. After snap() it is exactly the given camera
 * until it is moved.
 */
export class Navigation {
  #home; #target; #up; #axes; #azimuth; #elevation; #distance; #fov; #snapped = null;

  /** @param {ReturnType<typeof framingOf>} home */
  constructor(home) {
    this.#home = home;
    this.#up = home.up;
    this.#axes = groundAxes(home.up);
    this.reset();
  }

  get home() { return this.#home; }
  get snapped() { return this.#snapped !== null; }

  /** Back to the start. */
  reset() {
    this.#snapped = null;
    this.#target = this.#home.target;
    this.#distance = this.#home.distance;
    this.#fov = this.#home.fov;
    this.#azimuth = START_AZIMUTH;
    this.#elevation = START_ELEVATION;
  }

  /** Same direction, whole soup in view. */
  frame() {
    this.#release();
    this.#target = this.#home.target;
    this.#distance = this.#home.distance;
  }

  /** Orbits the target. */
  orbit(azimuth, elevation) {
    this.#release();
    this.#azimuth += azimuth;
    this.#elevation = clamp(this.#elevation + elevation, -STEEPEST, STEEPEST);
  }

  /** Turns around the eye. */
  look(azimuth, elevation) {
    this.#release();
    const eye = this.#eye();
    this.orbit(azimuth, elevation);
    this.#target = add(eye, this.#towardsEye(), -this.#distance);
  }

  /** Moves sideways. Unit: image height at the target's distance. */
  pan(right, up) {
    const height = 2 * this.#distance * Math.tan(0.5 * this.#fov);
    this.fly(right * height, up * height, 0);
  }

  /** Divides the distance to the target by `factor`. */
  zoom(factor) {
    this.#release();
    this.#distance = clamp(this.#distance / factor, 1e-4, 1e3);
  }

  /** Moves the eye and the target, in normalised units. */
  fly(right, up, ahead) {
    this.#release();
    const z = times(this.#towardsEye(), -1), x = normalize(cross(z, this.#up)), y = cross(x, z);
    this.#target = add(add(add(this.#target, x, right), y, up), z, ahead);
  }

  /** @param {Camera} camera */
  snap(camera) {
    this.#snapped = camera;
    this.#fov = 2 * Math.atan((0.5 * camera.height) / camera.fy);
  }

  /** @returns {Camera} */
  camera(width, height) {
    if (this.#snapped) return reshaped(this.#snapped, width, height);
    return lookAt(this.#eye(), this.#target, this.#up, this.#fov, width, height);
  }

  #towardsEye() { return direction(this.#axes, this.#up, this.#azimuth, this.#elevation); }

  #eye() { return add(this.#target, this.#towardsEye(), this.#distance); }

  /** Continues as a turntable camera at the position of the snapped one. */
  #release() {
    if (!this.#snapped) return;
    const eye = centre(this.#snapped), ahead = forward(this.#snapped);
    // The new target lies on the viewing axis at the distance of the soup's centre.
    this.#distance = Math.max(0.05 * this.#home.distance, dot(add(this.#home.target, eye, -1), ahead));
    const d = times(normalize(ahead), -1);
    this.#elevation = clamp(Math.asin(clamp(dot(d, this.#up), -1, 1)), -STEEPEST, STEEPEST);
    this.#azimuth = Math.atan2(dot(d, this.#axes[1]), dot(d, this.#axes[0]));
    this.#target = add(eye, this.#towardsEye(), -this.#distance);
    this.#snapped = null;
  }
}
