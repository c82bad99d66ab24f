// Cameras as scripts, links and files give them: world coordinates (those of the dataset), angles in degrees, matrices
// from camera to world, column-major, with OpenGL axes (x right, y up, z backward). tri-soup.d.ts describes them.
import { aspectOf, centre, forward, fovOf, lookAt, row } from "./camera.js";
import { SoupError } from "./error.js";
import { add, cross, dot, length, normalize, times } from "./vectors.js";

const FOV = [1, 170], ASPECT = [0.1, 10];
const FARTHEST_EYE = 1e4;  // normalised units: floats cannot resolve the soup from farther away
const DEGREES = 180 / Math.PI;

const toWorldPoint = (point, { scale, centre: c }) => add(c, point, 1 / scale);
/** World to normalised coordinates. */
export const toModelPoint = (point, { scale, centre: c }) => times(add(point, c, -1), scale);

/**
 * What a camera is in the world.
 * @param {import("./camera.js").Camera} camera
 * @param {number} distance between the eye and its target, normalised
 * @param {{scale: number, centre: number[]}} normalisation
 */
export function stateOf(camera, distance, normalisation) {
  const eye = centre(camera), position = toWorldPoint(eye, normalisation), up = times(row(camera, 1), -1);
  const matrix = [...row(camera, 0), 0, ...up, 0, ...times(forward(camera), -1), 0, ...position, 1];
  return { position, target: toWorldPoint(add(eye, forward(camera), distance), normalisation), up,
    fov: fovOf(camera) * DEGREES, aspect: aspectOf(camera), matrix };
}

/** A list of finite numbers. @throws SoupError if it is none */
export function numbersOf(values, count, what) {
  const list = values?.length === count ? Array.from(values) : [];
  if (list.length === count && list.every((value) => Number.isFinite(value) && Math.abs(value) < 1e15)) return list;
  throw new SoupError(`${what} is ${shortText(values)}; give ${count} finite numbers`);
}

/** A value as it stands in a message. */
export const shortText = (value) => {
  const text = typeof value === "string" ? JSON.stringify(value)
    : Array.isArray(value) || ArrayBuffer.isView(value) ? `[${Array.from(value).join(", ")}]` : String(value);
  return text.length > 60 ? `${text.slice(0, 57)}...` : text;
};

function within(value, [low, high], what, unit) {
  if (typeof value === "number" && value >= low && value <= high) return value;
  throw new SoupError(`${what} is ${shortText(value)}; give a number from ${low} to ${high}${unit}`);
}

/** Axes x, y (down), z (forward) of a matrix, without its scale. */
function axesOf(matrix, what) {
  const columns = [0, 4, 8].map((at) => matrix.slice(at, at + 3)), sizes = columns.map(length);
  const [x, up, back] = columns.map((column, i) => times(column, 1 / sizes[i]));
  const rotates = sizes.every((size) => size > 1e-9) && dot(cross(x, up), back) > 0.99;
  if (!rotates || Math.abs(matrix[15] - 1) > 1e-6 || [3, 7, 11].some((i) => Math.abs(matrix[i]) > 1e-6))
    throw new SoupError(`${what} is not a rotation and a position; give a column-major matrix from camera to world`);
  // Exactly orthonormal, as far as rounding allows.
  const z = times(back, -1), right = normalize(add(x, z, -dot(x, z)));
  return [right, cross(z, right), z];
}

/** Direction that can be up for a camera that looks along z. */
function possibleUp(z, ...candidates) {
  return candidates.find((up) => up && length(up) > 1e-9 && length(cross(z, normalize(up))) > 1e-3);
}

/**
 * Reads a camera.
 * @param {object} given `position` and `target`, or `matrix`; what is missing is taken from `now`
 * @param {object} now a state (see stateOf)
 * @param {{normalisation: object, up: number[], what: string}} context up: of the soup; what: prefix of messages
 * @returns {import("./camera.js").Camera} normalised coordinates
 * @throws {SoupError} if it is none
 */
export function cameraOf(given, now, { normalisation, up, what }) {
  if (given === null || typeof given !== "object")
    throw new SoupError(`${what} is ${shortText(given)}; give an object with position and target, or matrix`);
  const list = (name, count) =>
    given[name] === undefined ? undefined : numbersOf(given[name], count, `${what}.${name}`);
  const matrix = list("matrix", 16), target = list("target", 3);
  const fov = within(given.fov ?? now.fov, FOV, `${what}.fov`, " degrees");
  const aspect = within(given.aspect ?? now.aspect, ASPECT, `${what}.aspect`, "");
  // With a position the matrix is not needed: `{...soup.camera, position}` has both.
  const position = list("position", 3) ?? matrix?.slice(12, 15) ?? now.position;
  const eye = toModelPoint(position, normalisation);
  if (!(length(eye) < FARTHEST_EYE))
    throw new SoupError(`${what}.position is ${shortText(position)}, too far from the scene; give world coordinates`);
  const shape = (camera) => ({ ...camera, free: true });
  if (matrix && !(given.position && given.target)) {
    const axes = axesOf(matrix, `${what}.matrix`), pose = axes.flatMap((axis) => [...axis, -dot(axis, eye)]);
    const along = target ? dot(add(toModelPoint(target, normalisation), eye, -1), axes[2]) : 0;
    const { pose: _, ...lens } = lookAt([0, 0, 0], [0, 0, 1], [0, 1, 0], fov / DEGREES, 1000 * aspect, 1000);
    return shape({ ...lens, pose, ...(along > 1e-6 ? { distance: along } : {}) });
  }
  const aim = toModelPoint(target ?? now.target, normalisation), z = add(aim, eye, -1), distance = length(z);
  if (!(distance > 1e-6))
    throw new SoupError(`${what}.target is at its position; move one of them`);
  const itsUp = possibleUp(normalize(z), list("up", 3), given.position || given.target ? undefined : now.up, up,
    [0, 1, 0], [1, 0, 0]);
  return shape({ ...lookAt(eye, aim, normalize(itsUp), fov / DEGREES, 1000 * aspect, 1000), distance });
}
