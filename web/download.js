// Downloads models.
import { SoupError } from "./error.js";

/**
 * Loads the bytes of a file.
 * @param {string} source a URL, or "#id" of an element of the page whose text is the file in base64. Single-file pages
 *   embed the model this way, because a page opened from a disk cannot load other files.
 * @param {{signal: AbortSignal, onProgress: (loaded: number, total: number | null) => void}} options onProgress:
 *   called with bytes; total: null if unknown
 * @returns {Promise<Uint8Array>}
 * @throws {SoupError} if it cannot be loaded
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
  // Content-Length is the compressed length if the response is compressed.
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
    throw new SoupError(`${name}: the connection broke off after ${loaded} bytes; reload the page`);
  }
  const bytes = new Uint8Array(loaded);
  parts.reduce((at, part) => {
    bytes.set(part, at);
    return at + part.length;
  }, 0);
  return bytes;
}

/**
 * Loads a JSON file.
 * @param {string} source a URL, or "#id" of an element of the page whose text is the JSON
 * @throws {SoupError} if it cannot be loaded or is no JSON
 */
export async function downloadJson(source) {
  const name = source.startsWith("#") ? source : nameOf(source);
  const text = source.startsWith("#") ? document.getElementById(source.slice(1))?.textContent
    : new TextDecoder().decode(await download(new URL(source, document.baseURI).href,
      { signal: new AbortController().signal, onProgress: () => {} }));
  if (text === undefined) throw new SoupError(`${source}: the page has no such element; check its id`);
  try {
    return JSON.parse(text);
  } catch (error) {
    throw new SoupError(`${name}: is not JSON (${error.message}); check the address`);
  }
}

/** The name of a file in messages: the last part of its URL. */
export const nameOf = (source) => (source.split(/[?#]/)[0].split("/").pop() || source).slice(0, 120);

function embedded(source) {
  const text = document.getElementById(source.slice(1))?.textContent?.trim();
  if (!text) throw new SoupError(`${source}: the page has no such model; export it again`);
  const bytes = new Uint8Array(Math.floor((text.length * 3) / 4));
  let at = 0;
  try {
    // Decoded in parts: one string of the whole file would double the memory.
    for (let from = 0; from < text.length; from += 1 << 20)
      for (const letter of atob(text.slice(from, from + (1 << 20)))) bytes[at++] = letter.charCodeAt(0);
  } catch {
    throw new SoupError(`${source}: the model in this page is damaged; export it again`);
  }
  return bytes.subarray(0, at);
}
