// Shared by the tests of pages: a server, a browser, pictures of pages and the native renderer's pictures of the same
// views. `run` sets
//   TRISOUP_BIN      the folder of the programs
//   TRISOUP_MODEL    a model of the bundled scene
//   TRISOUP_LARGE    another model, of 15,000 triangles
//   TRISOUP_SCRATCH  a folder for files of the tests
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { readFileSync, readdirSync } from "node:fs";
import { join } from "node:path";
import { after, before } from "node:test";
import { fileURLToPath } from "node:url";
import { compare } from "./agreement.mjs";
import { Browser } from "./browser.mjs";
import { readPng } from "./png.mjs";
import { serve } from "./server.mjs";

export const { TRISOUP_BIN: bin, TRISOUP_MODEL: modelPath, TRISOUP_LARGE: largePath, TRISOUP_SCRATCH: scratch } =
  process.env;
export const model = readFileSync(modelPath);
export const SIZE = 200;  // of the views of the bundled scene

// The same driver for both: another's rasteriser snaps vertices to another grid, and pixels along edges go to a
// neighbour.
const driver = process.env.TRISOUP_SWIFTSHADER,
  environment = { ...process.env, VK_DRIVER_FILES: driver, VK_ICD_FILENAMES: driver };
export const native = (program, ...options) =>
  execFileSync(join(bin, program), [...options, "--device", "SwiftShader"], { env: environment });

/** A page with some elements and a style for all of them; the module is web/ as it is, or what soup-export wrote. */
export const html = (elements, module = "/web/tri-soup.js") =>
  `<!doctype html><meta charset="utf-8"><link rel="icon" href="/icon.png">
  <link rel="stylesheet" href="/style.css"><script type="module" src="${module}"></script>${elements}`;
// Any picture: browsers ask for an icon.
const ICON = Buffer.from(
  "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mP8z8BQDwAEhQGAhKmMIQAAAABJRU5ErkJggg==", "base64");
const style = "body { margin: 0; display: flex; flex-wrap: wrap } " +
  `tri-soup { width: ${SIZE}px; height: ${SIZE}px; aspect-ratio: auto }`;

export let browser, server;
/** What the server has: see serve(). Tests add to it. */
export const pages = {};

before(async () => {
  Object.assign(pages, {
    "/web/": fileURLToPath(new URL("../../web", import.meta.url)), "/style.css": style, "/icon.png": ICON,
    "/favicon.ico": ICON, "/model.glb": model,
    "/one.html": html('<tri-soup src="/model.glb"></tri-soup>'),
  });
  server = await serve(pages);
  browser = await Browser.launch();
});
after(async () => {
  await browser?.close();
  server?.close();
});

/** Opens a page whose elements all show something, runs a test in it, and finds no complaint in its console. */
export async function on(path, action, { screen = {}, allowed = [], wait = true, begin = null, by = browser } = {}) {
  const page = await by.page(screen);
  try {
    if (begin) await page.send("Page.addScriptToEvaluateOnNewDocument", { source: `(${begin})()` });
    await page.open(path.includes("://") ? path : server.url + path);
    if (wait)
      await page.run(() => Promise.all([...document.querySelectorAll("tri-soup")].map(async (soup) => {
        if (!soup.loaded)
          await new Promise((resolve, reject) => {
            soup.addEventListener("load", resolve);
            soup.addEventListener("error", (event) => reject(new Error(event.message)));
          });
      })));
    await action(page);
    const complaints = page.complaints
      .filter((line) => ![/willReadFrequently/, /GPU stall due to ReadPixels/, ...allowed]
        .some((pattern) => pattern.test(line)));
    assert.deepEqual(complaints, []);
  } finally {
    await page.close();
  }
}

/**
 * What an element shows, RGBA, and which triangles the samples of its last picture saw (where it was the last that was
 * drawn).
 */
export async function picture(page, index, { samples = 0, settings = {} } = {}) {
  const result = await page.run(async (which, count, wanted) => {
    const soup = document.querySelectorAll("tri-soup")[which];
    Object.assign(soup, wanted);
    do await new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve)));
    while (soup.moving);
    const canvas = soup.shadowRoot.querySelector("canvas"), { width, height } = canvas;
    const text = (array) => {
      const bytes = new Uint8Array(array.buffer);
      let letters = "";
      for (let at = 0; at < bytes.length; at += 8192) letters += String.fromCharCode(...bytes.subarray(at, at + 8192));
      return btoa(letters);
    };
    const hits = [];
    for (let sample = 0; sample < count; ++sample)
      hits.push(text((await import("/web/stage.js")).theStage().renderer.hits(width, height, sample)));
    return { width, height, rgba: text(canvas.getContext("2d").getImageData(0, 0, width, height).data), hits };
  }, index, samples, settings);
  const bytes = (text) => new Uint8Array(Buffer.from(text, "base64"));
  return { ...result, rgba: bytes(result.rgba), hits: result.hits.map((text) => new Uint32Array(bytes(text).buffer)) };
}

const nativePictures = new Map();
/**
 * Colour and triangles of a view by soup-view. Those from a model's cameras are drawn at once: starting costs more than
 * drawing.
 */
export function nativePicture(path, aa, size, ...from) {
  const all = aa === "none" && from[0] === "--camera" && /^\d+$/.test(from[1]),
    key = [path, aa, size, ...(all ? [] : from)].join(" ");
  if (!nativePictures.has(key))
    nativePictures.set(key, ["colour", "triangles"].map((mode) => {
      const out = join(scratch, all ? `native-${mode}` : "native.png"),
        what = all ? ["--path", "cameras", "-o", out] : ["--screenshot", out, ...from];
      native("soup-view", path, ...what, "--size", size, "--aa", aa, "--mode", mode);
      return all ? readdirSync(out).sort().map((name) => readPng(join(out, name)).rgb) : [readPng(out).rgb];
    }));
  return nativePictures.get(key).map((views) => views[all ? Number(from[1]) : 0]);
}

/** Holds a picture against soup-view's. Only with one sample a pixel are there no ties but the driver's own. */
export function agrees(drawn, aa, mostTies, ...from) { return agreesOn(modelPath, drawn, aa, mostTies, ...from); }

export function agreesOn(path, { rgba, hits, width, height }, aa, mostTies, ...from) {
  const [colour, triangles] = nativePicture(path, aa, `${width}x${height}`, ...from);
  const result = compare(rgba, hits, colour, triangles, [1, 1, 1]),
    what = `${aa} ${from.join(" ")}: ${JSON.stringify(result)}`;
  console.log(what);
  assert.ok(result.covered > 0.1 * result.pixels, `nothing to see, ${what}`);
  assert.ok(result.ties <= mostTies * result.pixels, `ties, ${what}`);
  assert.ok(result.psnr >= 50, `colours, ${what}`);
  return result;
}
