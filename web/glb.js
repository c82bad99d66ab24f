// The container of binary glTF 2.0: a JSON chunk and one binary chunk (engine/format/glb.cpp).
import { SoupError } from "./error.js";

const MAGIC = 0x46546c67, VERSION = 2, JSON_CHUNK = 0x4e4f534a, BINARY_CHUNK = 0x004e4942;
const FILE_HEADER = 12, CHUNK_HEADER = 8;

/**
 * Splits a file into its chunks. Does not interpret the document.
 * @param {Uint8Array} bytes the whole file; `binary` of the result refers to it
 * @param {string} name prefix of error messages
 * @returns {{document: object, binary: Uint8Array}}
 * @throws {SoupError} if a length in a header is wrong or the first chunk is not JSON
 */
export function decodeGlb(bytes, name) {
  const damaged = (what) =>
    new SoupError(`${name}: ${what}; the file is truncated or damaged, export or copy it again`);
  const data = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const u32 = (at) => {
    if (at + 4 > bytes.length) throw damaged("ends within a header");
    return data.getUint32(at, true);
  };
  if (bytes.length < 4 || u32(0) !== MAGIC) throw new SoupError(`${name}: is not a binary glTF file; give a model.glb`);
  if (u32(4) !== VERSION) throw new SoupError(`${name}: has glTF version ${u32(4)}, not 2; export it as glTF 2.0`);
  if (u32(8) !== bytes.length) throw damaged("has another length than its header states");

  let at = FILE_HEADER;
  const chunk = (type, missing) => {
    const size = u32(at);
    if (u32(at + 4) !== type || size > bytes.length - at - CHUNK_HEADER) throw damaged(missing);
    const content = bytes.subarray(at + CHUNK_HEADER, at + CHUNK_HEADER + size);
    at += CHUNK_HEADER + size;
    return content;
  };
  const text = chunk(JSON_CHUNK, "has no complete JSON chunk");
  let document;
  try {
    document = JSON.parse(new TextDecoder("utf-8", { fatal: true }).decode(text));
  } catch {
    throw damaged("has invalid JSON");
  }
  // Files without binary data have no second chunk.
  const binary = at < bytes.length ? chunk(BINARY_CHUNK, "has no complete binary chunk") : new Uint8Array(0);
  return { document, binary };
}
