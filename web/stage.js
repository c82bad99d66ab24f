// Shared by all soups of a page: one WebGL context, the models in it, and one animation loop.
//
// Browsers limit a page to about 16 contexts (8 on phones), and each needs its own shaders and targets. Therefore all
// soups are drawn on one hidden canvas and copied to the 2D canvas of their element. drawImage between canvases stays
// on the GPU, is exact (both canvases are opaque and have the same colour space and size) and works in every browser
// with WebGL2. Alternatives have drawbacks: transferToImageBitmap creates a drawing buffer per frame and needs
// OffscreenCanvas with WebGL (Safari 17); one canvas behind the page lags when scrolling and cannot be in two layers.
import { decodeModel } from "./model.js";
import { download, nameOf } from "./download.js";
import { makeContext } from "./gpu.js";
import { checkDecoder, decodePages } from "./pictures.js";
import { Renderer } from "./renderer.js";
import { releaseModel, uploadModel } from "./upload.js";

/** A model in use. The decoded file stays in memory, to upload it again after the context was lost. */
class Resident {
  users = 0;
  drawn = null;  // GpuModel; null while the context is lost
  abort = new AbortController();
  listeners = new Set();  // called with bytes loaded and the total, if known
  model = null;

  constructor(source) {
    this.source = source;
  }

  async load(stage) {
    const onProgress = (loaded, total) => this.listeners.forEach((listener) => listener(loaded, total));
    const bytes = await download(this.source, { signal: this.abort.signal, onProgress });
    this.model = decodeModel(bytes, nameOf(this.source));
    await this.upload(stage);
    return this;
  }

  async upload(stage) {
    const { model } = this;
    if (stage.renderer) await checkDecoder(stage.gl);
    const pages = await decodePages(model);
    // If the context is lost now, all models are uploaded when it is restored.
    if (this.users > 0 && stage.renderer && !this.drawn) this.drawn = uploadModel(stage.gl, model, pages);
    for (const picture of pages.flat()) picture.close?.();
  }
}

class Stage {
  /** @type {Renderer | null} null while the context is lost */
  renderer = null;
  #canvas = document.createElement("canvas");
  #residents = new Map();
  #elements = new Set();
  #frame = 0;

  /** @throws {SoupError} if WebGL2 is not available */
  constructor() {
    this.gl = makeContext(this.#canvas);
    this.#canvas.addEventListener("webglcontextlost", (event) => {
      event.preventDefault();  // allows the context to be restored
      this.renderer = null;
      for (const resident of this.#residents.values()) resident.drawn = null;
      for (const element of this.#elements) element.contextLost();
    });
    this.#canvas.addEventListener("webglcontextrestored", () => this.#restore());
    this.renderer = new Renderer(this.gl);
    this.#watchRatio();
  }

  /**
   * Reports changes of the device pixel ratio (another screen, zoom). A media query matches one ratio, so each change
   * needs a new query.
   */
  #watchRatio() {
    matchMedia(`(resolution: ${devicePixelRatio}dppx)`).addEventListener("change", () => {
      for (const element of this.#elements) element.ratioChanged();
      this.#watchRatio();
    }, { once: true });
  }

  async #restore() {
    let problem = null;
    try {
      this.renderer = new Renderer(this.gl);
      const loaded = [...this.#residents.values()].filter((resident) => resident.model);
      await Promise.all(loaded.map((resident) => resident.upload(this)));
    } catch (error) {
      problem = error;
    }
    if (!this.renderer) return;  // lost again meanwhile
    for (const element of this.#elements) element.contextRestored(problem);
  }

  /** Registers an element for tick(). */
  join(element) { this.#elements.add(element); }

  leave(element) {
    this.#elements.delete(element);
    if (this.#elements.size === 0) this.#canvas.width = this.#canvas.height = 1;
  }

  /**
   * Returns the model of a URL. Each URL is loaded once and shared. Its promise `ready` resolves to the model or
   * rejects with a SoupError. The caller must release() it.
   * @param {string} source absolute URL or "#id"
   */
  take(source) {
    let resident = this.#residents.get(source);
    if (!resident) {
      resident = new Resident(source);
      this.#residents.set(source, resident);
      resident.ready = resident.load(this);
      // After a failure the next take() loads it again.
      resident.ready.catch(() => this.#forget(resident));
    }
    ++resident.users;
    return resident;
  }

  release(resident) {
    if (--resident.users > 0) return;
    this.#forget(resident);
    resident.abort.abort();
    if (resident.drawn && this.renderer) releaseModel(this.gl, resident.drawn);
    resident.drawn = null;
  }

  #forget(resident) {
    if (this.#residents.get(resident.source) === resident) this.#residents.delete(resident.source);
  }

  /** Calls tick() of every element at the next display refresh. */
  wake() {
    this.#frame ||= requestAnimationFrame((now) => {
      this.#frame = 0;
      for (const element of this.#elements) element.tick(now);
    });
  }

  /**
   * Draws a frame and copies it to a 2D canvas of the same size.
   * @param {CanvasRenderingContext2D} context
   * @param {import("./renderer.js").GpuModel} drawn
   * @param {import("./camera.js").View} view
   * @param {{aa: string, dropBehind: boolean}} options
   */
  draw(context, drawn, view, options) {
    const { width, height } = view;
    if (this.#canvas.width < width) this.#canvas.width = width;
    if (this.#canvas.height < height) this.#canvas.height = height;
    this.renderer.draw(drawn, view, options);
    context.drawImage(this.#canvas, 0, 0, width, height, 0, 0, width, height);
  }

  /**
   * The model's triangle at a pixel of the frame that was drawn last, from 0; null if there is none.
   */
  triangleAt(x, y) {
    const hit = this.renderer.hitAt(x, y);
    return hit === 0 ? null : hit - 1;
  }
}

let stage = null;

/** Returns the stage of the page and creates it if needed. @throws {SoupError} if WebGL2 is not available */
export const theStage = () => (stage ??= new Stage());
