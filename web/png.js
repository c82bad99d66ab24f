// Checks PNG files. Browsers decode them (pictures.js), but accept damaged files silently.

const SIGNATURE = [0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a];
const END = 0x49454e44;  // "IEND"

const crcTable = Uint32Array.from({ length: 256 }, (_, n) => {
  for (let k = 0; k < 8; ++k) n = n & 1 ? 0xedb88320 ^ (n >>> 1) : n >>> 1;
  return n;
});

/** @param {Uint8Array} bytes */
export function crc32(bytes) {
  let crc = 0xffffffff;
  for (let i = 0; i < bytes.length; ++i) crc = crcTable[(crc ^ bytes[i]) & 255] ^ (crc >>> 8);
  return (crc ^ 0xffffffff) >>> 0;
}

/**
 * Width and height in pixels from the header; null if the bytes are not a PNG file.
 * @param {Uint8Array} bytes
 */
export function pngSize(bytes) {
  if (bytes.length < 24 || SIGNATURE.some((value, i) => bytes[i] !== value)) return null;
  const data = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const width = data.getUint32(16), height = data.getUint32(20);
  return width > 0 && height > 0 ? { width, height } : null;
}

/**
 * True if all chunks are complete and their CRCs are correct.
 * @param {Uint8Array} bytes
 */
export function isWholePng(bytes) {
  const data = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  for (let at = SIGNATURE.length; at + 12 <= bytes.length; ) {
    const length = data.getUint32(at);
    if (length > bytes.length - at - 12) return false;
    if (crc32(bytes.subarray(at + 4, at + 8 + length)) !== data.getUint32(at + 8 + length)) return false;
    if (data.getUint32(at + 4) === END) return true;
    at += 12 + length;
  }
  return false;
}
