// Models that soup-train does not write.
import { decodeGlb } from "../../web/glb.js";

/**
 * A model.glb with another document, or another binary part of the same length.
 * @param {Uint8Array} file
 * @param {(document: object, extension: object, binary: Uint8Array) => void} change
 * @returns {Uint8Array}
 */
export function edited(file, change) {
  const { document, binary: before } = decodeGlb(file, "x"),
    binary = new Uint8Array(before);  // a copy: Buffer.slice is none
  change(document, document.extensions.TRISOUP_neural_textures, binary);
  const text = Buffer.from(JSON.stringify(document)), padded = Buffer.alloc(Math.ceil(text.length / 4) * 4, " ");
  text.copy(padded);
  const head = Buffer.alloc(20), middle = Buffer.alloc(8);
  [0x46546c67, 2, 28 + padded.length + binary.length, padded.length, 0x4e4f534a]
    .forEach((value, i) => head.writeUInt32LE(value, 4 * i));
  middle.writeUInt32LE(binary.length, 0);
  middle.writeUInt32LE(0x004e4942, 4);
  return new Uint8Array(Buffer.concat([head, padded, middle, binary]));
}
