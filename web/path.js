// Reads paths of cameras: our JSON and nerfstudio's camera paths (tri-soup.d.ts describes both).
import { SoupError } from "./error.js";
import { cameraOf, numbersOf, shortText } from "./pose.js";
import { shotOf } from "./shot.js";

const MOST_KEYS = 100_000;

/** A row-major 4 x 4 or 3 x 4 matrix, flat or in rows, as column-major 4 x 4. */
function columnMajor(rows, what) {
  const flat = Array.isArray(rows) ? rows.flat() : [];
  const values = numbersOf(flat, flat.length === 12 ? 12 : 16, what);
  const whole = values.length === 12 ? [...values, 0, 0, 0, 1] : values;
  return Array.from({ length: 16 }, (_, i) => whole[4 * (i % 4) + (i >> 2)]);
}

/**
 * Takes a matrix of nerfstudio's scene to the dataset: world = inverse of (scale x transform).
 * @param {number[]} matrix camera to nerfstudio's scene, column-major
 * @param {object} dataparser contents of dataparser_transforms.json
 */
function undone(matrix, dataparser) {
  const what = "dataparser_transforms", transform = columnMajor(dataparser.transform, `${what}.transform`),
    { scale } = dataparser;
  if (!(Number.isFinite(scale) && scale > 0))
    throw new SoupError(`${what}.scale is ${shortText(scale)}; give a number above 0`);
  const at = (m, r, c) => m[4 * c + r], inverse = [0, 1, 2].map((i) => [0, 1, 2].map((k) => at(transform, k, i)));
  const result = [...matrix];
  for (let c = 0; c < 4; ++c) {
    const v = [0, 1, 2].map((k) => (c < 3 ? at(matrix, k, c) : at(matrix, k, 3) / scale - at(transform, k, 3)));
    inverse.forEach((axis, r) => { result[4 * c + r] = axis[0] * v[0] + axis[1] * v[1] + axis[2] * v[2]; });
  }
  return result;
}

/** Key frames of nerfstudio: one a picture, so many a second. */
function nerfstudioKeys({ camera_path: frames, fps, seconds }, what, dataparser) {
  const lasts = Number(seconds) > 0 && frames.length > 1 ? seconds / (frames.length - 1) : 1 / fps;
  if (!(lasts > 0 && Number.isFinite(lasts)))
    throw new SoupError(`${what}: has no fps and no seconds; add "fps": 24`);
  return frames.map((frame, i) => {
    const matrix = columnMajor(frame?.camera_to_world, `${what}: camera_path[${i}].camera_to_world`);
    return { time: i * lasts, matrix: dataparser ? undone(matrix, dataparser) : matrix, fov: frame.fov,
      aspect: frame.aspect };
  });
}

/**
 * @param {object} document
 * @param {string} what name of the path, prefix of messages
 * @param {object} context see cameraOf; `now`: the camera whose field of view key frames without one have; `pivot`:
 *   distance to the target of a camera that has none; `dataparser`: of nerfstudio
 * @returns {{keys: {time: number, shot: import("./shot.js").Shot}[], seconds: number, loop: boolean}}
 * @throws {SoupError} if it is no path
 */
export function readPath(document, what, { normalisation, up, now, pivot, dataparser }) {
  const nerfstudio = Array.isArray(document?.camera_path),
    list = nerfstudio ? document.camera_path : document?.keyframes;
  if (!Array.isArray(list) || list.length === 0 || list.length > MOST_KEYS)
    throw new SoupError(
      `${what}: is not a camera path; give JSON with a list "keyframes", or nerfstudio's "camera_path"`);
  const kind = nerfstudio ? "camera_path" : "keyframes";
  const states = nerfstudio ? nerfstudioKeys(document, what, dataparser) : list;
  const keys = states.map((state, i) => {
    const place = `${what}: ${kind}[${i}]`, time = state?.time;
    if (!(Number.isFinite(time) && time >= 0)) throw new SoupError(`${place}.time is ${shortText(time)}; give seconds`);
    if (i > 0 && time <= states[i - 1].time)
      throw new SoupError(`${place}.time is ${time}, not after the one before; sort the key frames by time`);
    if (state.matrix === undefined && (state.position === undefined || state.target === undefined))
      throw new SoupError(`${place} has no pose; give position and target, or matrix`);
    const camera = cameraOf(state, now, { normalisation, up, what: place });
    return { time, shot: shotOf(camera, camera.distance ?? pivot(camera)) };
  });
  return { keys, seconds: keys[keys.length - 1].time, loop: document.loop === true || document.is_cycle === true };
}
