// Serves folders on the loopback address with a strict Content-Security-Policy.
import { createHash } from "node:crypto";
import { createServer } from "node:http";
import { readFile } from "node:fs/promises";
import { extname, join, normalize } from "node:path";

export const POLICY = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; connect-src 'self'; " +
  "frame-src 'self'; base-uri 'none'; form-action 'none'";
const TYPES = { ".html": "text/html; charset=utf-8", ".js": "text/javascript", ".mjs": "text/javascript",
  ".css": "text/css", ".png": "image/png", ".glb": "model/gltf-binary" };

/**
 * @param {Record<string, string | Buffer | ((response: import("node:http").ServerResponse) => void)>} places what lies
 *   at an address: a folder (where the address ends with a slash), the bytes of a file, or what answers itself
 * @returns {Promise<{url: string, close: () => void}>}
 */
export async function serve(places) {
  const server = createServer(async (request, response) => {
    const asked = decodeURIComponent(new URL(request.url, "http://x").pathname),
      path = asked.endsWith("/") ? `${asked}index.html` : asked;
    const key = path in places ? path : Object.keys(places).find((p) => p.endsWith("/") && path.startsWith(p)),
      place = places[key];
    response.setHeader("Content-Security-Policy", POLICY);
    response.setHeader("X-Content-Type-Options", "nosniff");
    response.setHeader("Content-Type", TYPES[extname(path)] ?? "application/octet-stream");
    if (typeof place === "function") return place(response);
    try {
      const bytes = key === path ? Buffer.from(place) : await readFile(join(place, normalize(path.slice(key.length))));
      // Browsers take import maps from a page's text alone. Pages with one use three.js, which fetches the textures of
      // ordinary files as blobs.
      const map = extname(path) === ".html" && /<script type="importmap">([^<]*)</.exec(bytes.toString());
      if (map) response.setHeader("Content-Security-Policy",
        POLICY.replace("script-src", `script-src 'sha256-${createHash("sha256").update(map[1]).digest("base64")}'`)
          .replace("connect-src", "connect-src blob:"));
      response.setHeader("Content-Length", bytes.length);
      response.end(bytes);
    } catch {
      response.statusCode = 404;
      response.end();
    }
  });
  await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
  return { url: `http://127.0.0.1:${server.address().port}`,
    close: () => { server.closeAllConnections(); server.close(); } };
}
