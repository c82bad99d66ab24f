// Cameras between cameras: for animated changes and paths. Normalised coordinates.
import { aspectOf, centre, forward, fovOf, row } from "./camera.js";
import { poseOf, quaternionOf, slerp } from "./rotation.js";
import { add, blend, dot, times } from "./vectors.js";

/**
 * @typedef {object} Shot a camera in the form that can be mixed
 * @property {number[]} eye
 * @property {number[]} turn quaternion, world to camera
 * @property {number} distance from the eye to its target
 * @property {number} height of its image at distance 1
 * @property {number} aspect
 */

/** @param {import("./camera.js").Camera} camera @returns {Shot} */
export const shotOf = (camera, distance) => ({ eye: centre(camera), distance,
  turn: quaternionOf([0, 1, 2].map((i) => row(camera, i))), height: 2 * Math.tan(0.5 * fovOf(camera)),
  aspect: aspectOf(camera) });

/** @param {Shot} shot @returns {import("./camera.js").Camera} */
export function cameraOfShot({ eye, turn, distance, height, aspect }) {
  const rows = poseOf([...turn, 0, 0, 0]), axes = [0, 4, 8].map((at) => rows.slice(at, at + 3));
  const focal = 1000 / height;
  return { width: 1000 * aspect, height: 1000, fx: focal, fy: focal, cx: 500 * aspect, cy: 500, distance, free: true,
    pose: axes.flatMap((axis) => [...axis, -dot(axis, eye)]) };
}

const ahead = (turn) => poseOf([...turn, 0, 0, 0]).slice(8, 11);

/** From shot `a` (t = 0) to `b` (t = 1) around what they look at: the way does not lead through it. */
export function arc(a, b, t) {
  const turn = slerp(a.turn, b.turn, t), distance = a.distance * (b.distance / a.distance) ** t;
  const [from, to] = [a, b].map((shot) => add(shot.eye, ahead(shot.turn), shot.distance));
  const target = from.map((value, axis) => blend(value, to[axis], t));
  return { turn, distance, eye: add(target, ahead(turn), -distance), height: blend(a.height, b.height, t),
    aspect: blend(a.aspect, b.aspect, t) };
}

/** Slow at both ends. */
export const eased = (t) => t * t * (3 - 2 * t);

/**
 * The shot at a time of a path: a Catmull-Rom spline through the eyes, constant rotation between two key frames.
 * @param {{time: number, shot: Shot}[]} keys by time
 */
export function shotAt(keys, time) {
  const next = keys.findIndex((key) => key.time > time);
  if (next === 0) return keys[0].shot;
  if (next < 0) return keys[keys.length - 1].shot;
  const [a, b] = [keys[next - 1], keys[next]], seconds = b.time - a.time, t = (time - a.time) / seconds;
  // Tangents by the distance of the neighbours in time: key frames need not be evenly spaced.
  const slope = (before, after) =>
    times(add(after.shot.eye, before.shot.eye, -1), seconds / (after.time - before.time));
  const m0 = slope(keys[next - 2] ?? a, b), m1 = slope(a, keys[next + 1] ?? b);
  const eye = a.shot.eye.map((p, axis) => (2 * t ** 3 - 3 * t * t + 1) * p + (t ** 3 - 2 * t * t + t) * m0[axis] +
    (3 * t * t - 2 * t ** 3) * b.shot.eye[axis] + (t ** 3 - t * t) * m1[axis]);
  const between = (name) => blend(a.shot[name], b.shot[name], t);
  return { eye, turn: slerp(a.shot.turn, b.shot.turn, t), distance: between("distance"), height: between("height"),
    aspect: between("aspect") };
}
