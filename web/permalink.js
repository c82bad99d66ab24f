// The camera in the address of a page: #camera=3, or position, target, field of view, aspect and up direction.
import { SoupError } from "./error.js";
import { shortText } from "./pose.js";

const DIGITS = 9;

const parts = () => location.hash.slice(1).split("&").filter(Boolean);
const isOf = (key) => (part) => part.startsWith(`${key}=`);

/** Value of a key in the address; null if it has none. */
export function linkValue(key) {
  const part = parts().find(isOf(key));
  if (part === undefined) return null;
  try {
    return decodeURIComponent(part.slice(key.length + 1));
  } catch {
    return part.slice(key.length + 1);  // an edited address with a % that encodes nothing
  }
}

/** The page's address with another value of a key. */
export function linkWith(key, value) {
  const url = new URL(location.href);
  url.hash = [...parts().filter((part) => !isOf(key)(part)), `${key}=${value}`].join("&");
  return url.href;
}

/** Changes the address without a new entry in the history. Frames without an origin of their own have no address. */
export function showLink(key, value) {
  try {
    history.replaceState(history.state, "", linkWith(key, value));
  } catch {
    // The link can still be copied.
  }
}

/** @param {object} state see Rig.state */
export function encodeCamera({ index, position, target, fov, aspect, up }) {
  if (index !== null) return String(index);
  return [...position, ...target, fov, aspect, ...up].map((value) => Number(value.toPrecision(DIGITS))).join(",");
}

/**
 * @param {string} text
 * @returns {number | object} index of a camera, or a camera (see tri-soup.d.ts)
 * @throws {SoupError} if it is neither
 */
export function decodeCamera(text) {
  if (/^\d{1,9}$/.test(text)) return Number(text);
  const v = text.split(",").map((part) => (part.trim() === "" ? NaN : Number(part)));
  if ((v.length !== 8 && v.length !== 11) || !v.every(Number.isFinite))
    throw new SoupError(`the link's camera ${shortText(text)} is cut off or edited; copy the whole link again`);
  return { position: v.slice(0, 3), target: v.slice(3, 6), fov: v[6], aspect: v[7],
    ...(v.length > 8 ? { up: v.slice(8) } : {}) };
}
