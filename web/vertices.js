// Decodes the vertices of a model.glb without a mesh. They are arithmetically coded integers on a grid whose spacing
// can differ per triangle (engine/format/vertex_code.cpp).
import { RangeDecoder } from "./range_decoder.js";

const MOST_BITS = 26, MOST_EXPONENT = 30, MOST_STEPS = 1 << 24;
/** Probabilities of a number: its count of bits, its sign, the bits after the first one. */
const SIGN_OF_NUMBER = MOST_BITS, REST_OF_NUMBER = SIGN_OF_NUMBER + 1, NUMBER = REST_OF_NUMBER + MOST_BITS;
/** Sets of probabilities: one for exponents, then one per corner, axis and count of bits of the number before. */
const NUMBERS = 1 + 9 * (MOST_BITS + 1);

function wholeNumber(decoder, chances) {
  let bits = 0, number = 1;
  while (bits < MOST_BITS && decoder.decide(chances + bits)) ++bits;
  if (bits === 0) return 0;
  const negative = decoder.decide(chances + SIGN_OF_NUMBER);
  for (let bit = bits - 2; bit >= 0; --bit)
    number = (number << 1) | decoder.decide(chances + REST_OF_NUMBER + (bit === bits - 2 ? bits - 1 : 0));
  return negative ? -number : number;
}

const bitsOf = (number) => 32 - Math.clz32(Math.abs(number));

/**
 * Decodes the corners of all triangles in normalised coordinates; null if the bytes end too early or a number exceeds
 * its limits.
 * @param {Uint8Array} bytes
 * @param {number} triangles
 * @returns {Float32Array | null} x, y, z of three corners per triangle
 */
export function decodeVertices(bytes, triangles) {
  // Limits memory: damaged headers can claim any number, but real files have at least 4 bytes per triangle.
  if (triangles > 4096 + bytes.length / 4) return null;
  const decoder = new RangeDecoder(bytes, NUMBERS * NUMBER), corners = new Int32Array(9);
  const vertices = new Float32Array(9 * triangles);
  let exponent = 0, side = 0;
  for (let t = 0; t < triangles; ++t) {
    const before = exponent;
    exponent += wholeNumber(decoder, 0);
    if (decoder.ended || Math.abs(exponent) > MOST_EXPONENT) return null;
    // The first corner is relative to the centre of the triangle before, the others to the first corner.
    let from = [0, 1, 2].map((axis) => {
      const sum = corners[axis] + corners[3 + axis] + corners[6 + axis];
      return Math.min(Math.max(Math.floor((sum * 2 ** (exponent - before)) / 3), -MOST_STEPS), MOST_STEPS);
    });
    for (let corner = 0; corner < 3; ++corner) {
      let bits = side;
      for (let axis = 0; axis < 3; ++axis) {
        const away = wholeNumber(decoder, NUMBER * (1 + (3 * corner + axis) * (MOST_BITS + 1) + bits)),
          steps = from[axis] + away;
        if (Math.abs(steps) > MOST_STEPS) return null;
        corners[3 * corner + axis] = steps;
        bits = axis === 0 ? bitsOf(away) : Math.max(bits, bitsOf(away));
      }
      if (corner === 0) from = Array.from(corners.subarray(0, 3));
      if (corner === 1) side = bits;
    }
    for (let i = 0; i < 9; ++i) vertices[9 * t + i] = corners[i] * 2 ** -exponent;
  }
  return decoder.ended ? null : vertices;
}
