// Pixels of the PNG files that the native programs write: 8 bits, RGB or RGBA, not interlaced.
import { readFileSync } from "node:fs";
import { inflateSync } from "node:zlib";

/** @returns {{width: number, height: number, rgb: Uint8Array}} */
export function readPng(path) {
  const { width, height, rgba } = rgbaOf(readFileSync(path), path), rgb = new Uint8Array(3 * width * height);
  for (let i = 0; i < width * height; ++i) rgb.set(rgba.subarray(4 * i, 4 * i + 3), 3 * i);
  return { width, height, rgb };
}

/**
 * @param {Buffer} file
 * @returns {{width: number, height: number, rgba: Uint8Array}}
 */
export function rgbaOf(file, path = "PNG") {
  const parts = [];
  const width = file.readUInt32BE(16), height = file.readUInt32BE(20), channels = { 2: 3, 6: 4 }[file[25]];
  if (file[24] !== 8 || !channels || file[28] !== 0)
    throw new Error(`${path}: not the kind of PNG that trisoup writes`);
  for (let at = 8; at < file.length; at += 12 + file.readUInt32BE(at))
    if (file.toString("latin1", at + 4, at + 8) === "IDAT")
      parts.push(file.subarray(at + 8, at + 8 + file.readUInt32BE(at)));
  const rows = inflateSync(Buffer.concat(parts)), bytes = width * channels,
    rgba = new Uint8Array(4 * width * height).fill(255);
  let above = new Uint8Array(bytes);
  for (let y = 0; y < height; ++y) {
    const filter = rows[y * (bytes + 1)],
      row = new Uint8Array(rows.subarray(y * (bytes + 1) + 1, (y + 1) * (bytes + 1)));
    if (filter !== 2 && filter !== 0) throw new Error(`${path}: not the kind of PNG that trisoup writes`);
    if (filter === 2) for (let i = 0; i < bytes; ++i) row[i] += above[i];
    for (let x = 0; x < width; ++x) rgba.set(row.subarray(channels * x, channels * (x + 1)), 4 * (y * width + x));
    above = row;
  }
  return { width, height, rgba };
}
