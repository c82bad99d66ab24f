// Moves a camera around a soup, as in viewer/navigation.cpp. Normalised coordinates; angles in radians.
import { aspectOf, centre, direction, fitted, forward, fovOf, groundAxes, lookAt } from "./camera.js";
import { add, blend, clamp, cross, dot, length, normalize, times } from "./vectors.js";

const STEEPEST = 1.55;  // the horizon is undefined when looking straight up or down
const START_AZIMUTH = 0.6, START_ELEVATION = 0.35;
const NEAREST = 1e-4, FARTHEST = 1e3;
const RESTS = 2e-4;  // radians, or shares of the distance: smaller steps cannot be seen

/**
 * A turntable camera that orbits a target and keeps the horizon level. After snap() it is exactly the given camera
 * until it is moved.
 */
export class Navigation {
  /** Time constant in seconds with which the camera follows its movements; 0: at once. Needs settle() if above 0. */
  damping = 0;
  #home; #up; #axes; #goal; #shown; #fov; #aspect; #snapped = null;

  /** @param {ReturnType<typeof import("./camera.js").framingOf>} home */
  constructor(home) {
    this.#home = home;
    this.#up = home.up;
    this.#axes = groundAxes(home.up);
    this.reset();
  }

  get home() { return this.#home; }
  get snapped() { return this.#snapped !== null; }
  /** True if it is one of the model's cameras. */
  get exact() { return this.#snapped !== null && !this.#snapped.free; }
  /** Distance between the eye and the point that it orbits. */
  get distance() { return this.#snapped ? this.#pivotDistance(this.#snapped) : this.#shown.distance; }

  /** Back to the start. */
  reset() {
    this.#release();
    this.#fov = this.#home.fov;
    this.#aspect = this.#home.aspect ?? 1;
    // The nearest of the equal azimuths: after many turns it does not spin back.
    const turns = Math.round(((this.#goal?.azimuth ?? 0) - START_AZIMUTH) / (2 * Math.PI));
    this.#change({ target: this.#home.target, distance: this.#home.distance,
      azimuth: START_AZIMUTH + 2 * Math.PI * turns, elevation: START_ELEVATION });
  }

  /** Same direction, whole soup in view. */
  frame() {
    this.#release();
    this.#change({ target: this.#home.target, distance: this.#home.distance });
  }

  /** Orbits the target. */
  orbit(azimuth, elevation) {
    this.#release();
    this.#change({ azimuth: this.#goal.azimuth + azimuth,
      elevation: clamp(this.#goal.elevation + elevation, -STEEPEST, STEEPEST) });
  }

  /** Turns around the eye. */
  look(azimuth, elevation) {
    this.#release();
    const eye = this.#eye(this.#goal), { distance } = this.#goal;
    this.orbit(azimuth, elevation);
    this.#change({ target: add(eye, this.#towardsEye(this.#goal), -distance) });
  }

  /** Moves sideways. Unit: image height at the target's distance. */
  pan(right, up) {
    this.#release();
    const height = 2 * this.#goal.distance * Math.tan(0.5 * this.#fov);
    this.fly(right * height, up * height, 0);
  }

  /** Divides the distance to the target by `factor`. */
  zoom(factor) {
    this.#release();
    this.#change({ distance: clamp(this.#goal.distance / factor, NEAREST, FARTHEST) });
  }

  /** Moves the eye and the target, in normalised units. */
  fly(right, up, ahead) {
    this.#release();
    const z = times(this.#towardsEye(this.#goal), -1), x = normalize(cross(z, this.#up)), y = cross(x, z);
    this.#change({ target: add(add(add(this.#goal.target, x, right), y, up), z, ahead) });
  }

  /** @param {import("./camera.js").Camera} camera */
  snap(camera) {
    this.#snapped = camera;
    this.#fov = fovOf(camera);
    this.#aspect = aspectOf(camera);
  }

  /** Follows the movements for some seconds. @returns {boolean} true if it has not arrived */
  settle(seconds) {
    if (this.#shown === this.#goal) return false;
    const share = this.damping > 0 ? 1 - Math.exp(-seconds / this.damping) : 1, from = this.#shown, to = this.#goal;
    const distance = from.distance * (to.distance / from.distance) ** share;
    const shown = { distance, azimuth: blend(from.azimuth, to.azimuth, share),
      elevation: blend(from.elevation, to.elevation, share),
      target: from.target.map((value, axis) => blend(value, to.target[axis], share)) };
    const left = Math.max(Math.abs(to.azimuth - shown.azimuth), Math.abs(to.elevation - shown.elevation),
      Math.abs(Math.log(to.distance / distance)), length(add(to.target, shown.target, -1)) / to.distance);
    this.#shown = left < RESTS ? to : shown;
    return true;
  }

  /** @returns {import("./camera.js").Camera} */
  camera(width, height) {
    return fitted(this.reference(), width, height);
  }

  /** The camera with an image of its own shape. */
  reference() {
    if (this.#snapped) return this.#snapped;
    const camera = lookAt(this.#eye(this.#shown), this.#shown.target, this.#up, this.#fov, 1000 * this.#aspect, 1000);
    return { ...camera, distance: this.#shown.distance, free: true };
  }

  #change(values) {
    this.#goal = { ...this.#goal, ...values };
    if (!(this.damping > 0)) this.#shown = this.#goal;
  }

  #towardsEye({ azimuth, elevation }) { return direction(this.#axes, this.#up, azimuth, elevation); }

  #eye(state) { return add(state.target, this.#towardsEye(state), state.distance); }

  /** Unless it is known, the point on the viewing axis at the distance of the soup's centre. */
  #pivotDistance(camera) {
    return camera.distance ?? Math.max(0.05 * this.#home.distance,
      dot(add(this.#home.target, centre(camera), -1), forward(camera)));
  }

  /** Continues as a turntable camera at the position of the snapped one. */
  #release() {
    if (!this.#snapped) return;
    const eye = centre(this.#snapped), d = times(normalize(forward(this.#snapped)), -1);
    const distance = this.#pivotDistance(this.#snapped);
    const elevation = clamp(Math.asin(clamp(dot(d, this.#up), -1, 1)), -STEEPEST, STEEPEST);
    const azimuth = Math.atan2(dot(d, this.#axes[1]), dot(d, this.#axes[0]));
    const target = add(eye, direction(this.#axes, this.#up, azimuth, elevation), -distance);
    this.#goal = this.#shown = { target, azimuth, elevation, distance };
    this.#snapped = null;
  }
}
