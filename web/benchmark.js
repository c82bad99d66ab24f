// Measures frame times of one or more scenes, side by side on one canvas, from the views of soup-view --benchmark.
import { framingOf, hemisphere, reshaped, viewOf } from "./camera.js";
import { SoupError } from "./error.js";
import { makeContext } from "./gpu.js";
import { decodeModel } from "./model.js";
import { checkDecoder, decodePages } from "./pictures.js";
import { Renderer } from "./renderer.js";
import { uploadModel } from "./upload.js";

/** Yields to the browser without the 4 ms delay of timers. */
const pause = () => new Promise((resolve) => {
  const { port1, port2 } = new MessageChannel();
  port1.onmessage = () => { port1.close(); resolve(); };
  port2.postMessage(null);
});

/**
 * Arranges `count` scenes in a grid such that the largest square that fits in a cell is as large as possible.
 * @returns {{width: number, height: number, columns: number}} width, height: of a cell, pixels
 */
export function gridOf(count, width, height) {
  const grids = Array.from({ length: count }, (_, i) => {
    const columns = i + 1, rows = Math.ceil(count / columns);
    return { width: Math.max(1, Math.floor(width / columns)), height: Math.max(1, Math.floor(height / rows)), columns };
  });
  const square = (grid) => Math.min(grid.width, grid.height);
  return grids.reduce((best, grid) => (square(grid) > square(best) ? grid : best));
}

/**
 * Mean and percentiles, computed as in soup-view --benchmark; null if `ms` is empty.
 * @param {number[]} ms
 */
export function statistics(ms) {
  if (ms.length === 0) return null;
  const sorted = [...ms].sort((a, b) => a - b), quantile = (q) => sorted[Math.floor(q * (sorted.length - 1) + 0.5)];
  return {
    frames: ms.length, mean_ms: ms.reduce((sum, value) => sum + value, 0) / ms.length, p50_ms: quantile(0.5),
    p90_ms: quantile(0.9), p99_ms: quantile(0.99),
  };
}

/** Draws scenes on a canvas and measures the time. */
export class Benchmark {
  #canvas; #gl; #renderer; #timer; #drawn = []; #lost = false;

  /** @param {HTMLCanvasElement} canvas @throws {SoupError} if WebGL2 is not available */
  constructor(canvas) {
    this.#canvas = canvas;
    this.#gl = makeContext(canvas);
    canvas.addEventListener("webglcontextlost", () => { this.#lost = true; });
    this.#renderer = new Renderer(this.#gl);
    this.#timer = this.#gl.getExtension("EXT_disjoint_timer_query_webgl2");
  }

  /**
   * Adds a scene.
   * @param {Uint8Array} bytes a model.glb file
   * @param {string} name file name for messages
   * @throws {SoupError} if the file is invalid or the device cannot hold it
   */
  async add(bytes, name) {
    const model = decodeModel(bytes, name);
    await checkDecoder(this.#gl);
    const pages = await decodePages(model);
    this.#check();
    this.#drawn.push(uploadModel(this.#gl, model, pages));
    for (const picture of pages.flat()) picture.close?.();
  }

  /**
   * @param {{width: number, height: number, views: number, warmup: number, aa: "none" | "msaa" | "ssaa"}} options
   *   width, height: size of the whole canvas, pixels; views: number of views of the hemisphere
   * @param {(done: number) => void} onProgress called with the completed fraction, 0 to 1
   * @returns {Promise<object>} contents of the JSON file; times in milliseconds
   * @throws {SoupError} if the canvas is too large or the graphics device is lost
   */
  async run({ width, height, views, warmup, aa }, onProgress) {
    const most = this.#renderer.largestSide;
    if (width > most || height > most)
      throw new SoupError(
        `${width} x ${height} pixels exceed the limit of this device, ${most} a side; give a smaller size`);
    this.#canvas.width = width;
    this.#canvas.height = height;
    const grid = gridOf(this.#drawn.length, width, height), sets = this.#views(views, grid);
    const passes = Object.entries(sets), total = passes.reduce((sum, [, list]) => sum + 2 * list.length + warmup, 0);
    const result = this.#about({ width, height, warmup, aa, grid });
    let done = 0;
    for (const [name, list] of passes) {
      const draw = (i) => { this.#draw(list[i % list.length], grid, aa); onProgress(++done / total); };
      for (let i = 0; i < warmup; ++i) await this.#timed(() => draw(i));
      result[name] = await this.#measure(list.length, draw);
      result[name].display = await this.#displayed(list.length, draw);
    }
    result.gpu_bytes = this.#drawn.reduce((sum, drawn) => sum + drawn.bytes, 0) + this.#renderer.targetBytes +
      4 * width * height;
    result.heap_bytes = performance.memory?.usedJSHeapSize ?? null;
    return result;
  }

  /** Draws one view of the hemisphere, as run() does. */
  show({ width, height, views, aa }, index) {
    this.#canvas.width = width;
    this.#canvas.height = height;
    const grid = gridOf(this.#drawn.length, width, height);
    this.#draw(this.#views(views, grid).hemisphere[index], grid, aa);
  }

  #check() {
    if (this.#lost || this.#gl.isContextLost())
      throw new SoupError(
        "the graphics device was lost (out of memory or a frame took too long); reload the page and measure less");
  }

  /**
   * Views of the hemisphere and, if all models have cameras, views of these cameras. Each entry of a list has one view
   * per scene.
   */
  #views(count, { width, height }) {
    const clip = (drawn, camera) => viewOf(camera, drawn.model.near, drawn.model.far);
    const sky = this.#drawn
      .map((drawn) => hemisphere(framingOf(drawn.model), count, width, height).map((camera) => clip(drawn, camera)));
    const sets = { hemisphere: Array.from({ length: count }, (_, i) => sky.map((views) => views[i])) };
    const most = Math.max(...this.#drawn.map(({ model }) => model.cameras.length));
    if (this.#drawn.some(({ model }) => model.cameras.length === 0)) return sets;
    const photographs = this.#drawn
      .map((drawn) => drawn.model.cameras.map((camera) => clip(drawn, reshaped(camera, width, height))));
    return { cameras: Array.from({ length: most }, (_, i) => photographs.map((views) => views[i % views.length])),
      ...sets };
  }

  #draw(views, grid, aa) {
    this.#drawn.forEach((drawn, i) => {
      const left = (i % grid.columns) * grid.width, top = Math.floor(i / grid.columns) * grid.height;
      this.#renderer.draw(drawn, views[i], { aa, dropBehind: drawn.model.dropNear, left, top });
    });
  }

  /**
   * Draws a frame and returns the time until it is complete. Browsers wait for completion only when a pixel is read.
   */
  async #timed(draw) {
    const gl = this.#gl, start = performance.now();
    draw();
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
    const ms = performance.now() - start;
    this.#check();
    await pause();
    return ms;
  }

  async #measure(count, draw) {
    const gl = this.#gl, timer = this.#timer, queries = [], ms = [];
    if (timer) gl.getParameter(timer.GPU_DISJOINT_EXT);  // clears the flag
    for (let i = 0; i < count; ++i) {
      const query = timer ? gl.createQuery() : null;
      ms.push(await this.#timed(() => {
        if (query) gl.beginQuery(timer.TIME_ELAPSED_EXT, query);
        draw(i);
        if (query) gl.endQuery(timer.TIME_ELAPSED_EXT);
      }));
      if (query) queries.push(query);
    }
    const gpu = await this.#queried(queries);
    return { ...statistics(ms), frame_ms: ms, gpu: gpu && { ...statistics(gpu), frame_ms: gpu } };
  }

  /** GPU times; null if there is no timer or its clock was disturbed, for example by power saving. */
  async #queried(queries) {
    const gl = this.#gl;
    if (queries.length === 0) return null;
    const available = () => queries.every((query) => gl.getQueryParameter(query, gl.QUERY_RESULT_AVAILABLE));
    for (let tries = 0; tries < 200 && !available(); ++tries)
      await new Promise((resolve) => setTimeout(resolve, 10));
    const whole = available() && !gl.getParameter(this.#timer.GPU_DISJOINT_EXT);
    const ms = whole ? queries.map((query) => gl.getQueryParameter(query, gl.QUERY_RESULT) / 1e6) : null;
    for (const query of queries) gl.deleteQuery(query);
    return ms;
  }

  /** Frames shown per second, limited by the refresh rate of the display. */
  async #displayed(count, draw) {
    const refresh = () => new Promise((resolve) => requestAnimationFrame(resolve));
    const start = await refresh();
    let end = start;
    for (let i = 0; i < count; ++i) {
      draw(i);
      end = await refresh();
    }
    this.#check();
    return { frames: count, per_second: (1000 * count) / Math.max(1e-3, end - start) };
  }

  #about({ width, height, warmup, aa, grid }) {
    const gl = this.#gl, info = gl.getExtension("WEBGL_debug_renderer_info");
    return {
      device: gl.getParameter(info ? info.UNMASKED_RENDERER_WEBGL : gl.RENDERER), browser: navigator.userAgent, width,
      height, aa, warmup,
      scene_width: grid.width, scene_height: grid.height, timer: this.#timer !== null,
      scenes: this.#drawn.map(({ model, opaque, masked, bytes }) =>
        ({ model: model.name, triangles: model.triangles, opaque, masked, gpu_bytes: bytes })),
    };
  }
}
