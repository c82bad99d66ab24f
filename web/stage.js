// What all soups of a page share: one WebGL context, the models in it, and one clock.
//
// Browsers allow a page some 16 contexts (8 on phones), and each would hold its shaders and targets anew. So there is
// one canvas that nobody sees; each element has a 2D canvas, to which its part of a picture is copied. drawImage
// between canvases stays on the GPU, is exact (both are opaque, of one colour space and size) and works in every
// browser with WebGL2. Two other ways lost: transferToImageBitmap makes a new drawing buffer for every picture, and
// needs OffscreenCanvas with WebGL (Safari 17); one canvas behind the whole page scrolls late and cannot lie in two
// layers.
import { decodeModel } from "./model.js";
import { download, nameOf } from "./download.js";
import { makeContext } from "./gpu.js";
import { checkDecoder, decodePages } from "./pictures.js";
import { Renderer } from "./renderer.js";
import { releaseModel, uploadModel } from "./upload.js";

/** A model in use: the file's bytes stay, since a context that was lost wants them again. */
class Resident {
  users = 0;
  drawn = null;  // GpuModel, while there is a context
  abort = new AbortController();
  listeners = new Set();  // of progress: called with bytes loaded, and in all where that is known
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
    // Without a context now, all models are uploaded when it comes back.
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

  /** @throws {SoupError} without WebGL2 */
  constructor() {
    this.gl = makeContext(this.#canvas);
    this.#canvas.addEventListener("webglcontextlost", (event) => {
      event.preventDefault();  // it is to come back
      this.renderer = null;
      for (const resident of this.#residents.values()) resident.drawn = null;
      for (const element of this.#elements) element.contextLost();
    });
    this.#canvas.addEventListener("webglcontextrestored", () => this.#restore());
    this.renderer = new Renderer(this.gl);
    this.#watchRatio();
  }

  /**
   * A window that moves to another screen, or a page that is zoomed: a query knows one ratio, so each change wants a
   * new one.
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
    if (!this.renderer) return;  // lost again in between
    for (const element of this.#elements) element.contextRestored(problem);
  }

  /** Elements of the page join and leave; those that joined are asked for pictures. */
  join(element) { this.#elements.add(element); }

  leave(element) {
    this.#elements.delete(element);
    if (this.#elements.size === 0) this.#canvas.width = this.#canvas.height = 1;
  }

  /**
   * A model by its address, loaded once however many show it: its `ready` becomes itself, or a SoupError. Whoever takes
   * one gives it back with release().
   * @param {string} source absolute address or "#id"
   */
  take(source) {
    let resident = this.#residents.get(source);
    if (!resident) {
      resident = new Resident(source);
      this.#residents.set(source, resident);
      resident.ready = resident.load(this);
      // Whoever tries again starts anew.
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

  /** Asks for a picture of every element that wants one, with the display's next refresh. */
  wake() {
    this.#frame ||= requestAnimationFrame((now) => {
      this.#frame = 0;
      for (const element of this.#elements) element.tick(now);
    });
  }

  /**
   * Draws a picture and copies it to a 2D canvas of its size.
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
}

let stage = null;

/** The page's stage, made when first asked for. @throws {SoupError} without WebGL2 */
export const theStage = () => (stage ??= new Stage());
