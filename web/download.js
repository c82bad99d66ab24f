// Gets the bytes of a model.
import { SoupError } from "./error.js";

/**
 * @param {string} source an address, or "#id" of an element of the page that holds the file as base64 text: pages of
 *   one file, opened from a disk, may load nothing else
 * @param {{signal: AbortSignal, onProgress: (loaded: number, total: number | null) => void}} options bytes; total:
 *   where it is known
 * @returns {Promise<Uint8Array>}
 * @throws {SoupError} when it cannot be had
 */
export async function download(source, { signal, onProgress }) {
  if (source.startsWith("#")) return embedded(source);
  const name = nameOf(source);
  let response;
  try {
    response = await fetch(source, { signal });
  } catch (error) {
    if (signal.aborted) throw error;
    throw new SoupError(`${name}: cannot be reached; check the connection and the address`);
  }
  if (!response.ok) throw new SoupError(`${name}: the server answers ${response.status}; check the address`);
  // The length is that of what is sent, packed perhaps.
  const packed = response.headers.get("Content-Encoding"), length = Number(response.headers.get("Content-Length"));
  const total = !packed && length > 0 ? length : null;
  const parts = [];
  let loaded = 0;
  try {
    for (const reader = response.body.getReader(); ; ) {
      const { done, value } = await reader.read();
      if (done) break;
      parts.push(value);
      loaded += value.length;
      onProgress(loaded, total);
    }
  } catch (error) {
    if (signal.aborted) throw error;
    throw new SoupError(`${name}: the connection broke off after ${loaded} bytes; load the page again`);
  }
  const bytes = new Uint8Array(loaded);
  parts.reduce((at, part) => {
    bytes.set(part, at);
    return at + part.length;
  }, 0);
  return bytes;
}

/** What messages call a file: the last part of its address. */
export const nameOf = (source) => (source.split(/[?#]/)[0].split("/").pop() || source).slice(0, 120);

function embedded(source) {
  const text = document.getElementById(source.slice(1))?.textContent?.trim();
  if (!text) throw new SoupError(`${source}: the page has no such model; export it again`);
  const bytes = new Uint8Array(Math.floor((text.length * 3) / 4));
  let at = 0;
  try {
    // In parts: a string of the whole would take as much memory again.
    for (let from = 0; from < text.length; from += 1 << 20)
      for (const letter of atob(text.slice(from, from + (1 << 20)))) bytes[at++] = letter.charCodeAt(0);
  } catch {
    throw new SoupError(`${source}: the model in this page is damaged; export it again`);
  }
  return bytes.subarray(0, at);
}
