// <tri-soup src poster camera aa autorotate>: shows a soup in a page.
import { Navigation, framingOf, viewOf } from "./camera.js";
import { SoupError } from "./error.js";
import { Input } from "./input.js";
import { SAMPLES } from "./shaders.js";
import { theStage } from "./stage.js";

const FREE_NEAR = 0.01, FREE_FAR = 10;   // clip planes of a free camera, as in soup-view
const RADIANS_PER_SECOND = 0.25;         // speed of autorotate
const LOST = "The graphics device was lost. The scene returns with the device; if not, reload the page.";

// A strict Content-Security-Policy allows constructed style sheets, but no style elements.
const style = `
:host {
  display: block; position: relative; aspect-ratio: 16 / 9; overflow: hidden; touch-action: none; cursor: grab;
  user-select: none; -webkit-user-select: none
}
:host(:active) { cursor: grabbing }
:host([hidden]) { display: none }
canvas, img { position: absolute; inset: 0; width: 100%; height: 100%; display: block }
img { object-fit: cover }
progress {
  position: absolute; left: 10%; bottom: 5%; width: 80%; height: 4px; appearance: none; border: 0; background: #8886
}
progress::-webkit-progress-bar { background: #8886 }
progress::-webkit-progress-value { background: #fffc }
progress::-moz-progress-bar { background: #fffc }
p {
  position: absolute; left: 0; right: 0; bottom: 0; margin: 0; padding: 0.75em 1em; overflow-wrap: anywhere;
  font: 14px/1.4 system-ui, sans-serif; color: #fff; background: #000c
}
[hidden] { display: none }
`;
let sheet = null;

function dress(root) {
  try {
    if (!sheet) {
      sheet = new CSSStyleSheet();
      sheet.replaceSync(style);
    }
    root.adoptedStyleSheets = [sheet];
  } catch {
    // Safari before 16.4 has no constructed style sheets; a style element works unless a policy forbids it.
    root.append(Object.assign(document.createElement("style"), { textContent: style }));
  }
}

export class TriSoup extends HTMLElement {
  static observedAttributes = ["src", "poster", "camera", "aa", "autorotate"];

  #canvas = document.createElement("canvas");
  #context = this.#canvas.getContext("2d", { alpha: false });
  #poster = document.createElement("img");
  #progress = document.createElement("progress");
  #message = document.createElement("p");
  #input;
  #stage = null;
  #resident = null;       // the model, shown or loading
  #navigation = null;     // null until the model is loaded
  #cameraIndex = null;    // last camera selected
  #rotating = false;
  #visible = true;
  #dirty = false;
  #connected = false;
  #first = true;          // nothing of this source has been drawn yet
  #time = null;           // of the last tick during an animation
  #resize; #intersection;
  #box = { width: 0, height: 0 };  // CSS pixels
  #ratio = devicePixelRatio;       // device pixel ratio of the canvas

  constructor() {
    super();
    const root = this.attachShadow({ mode: "open" });
    dress(root);
    this.#poster.alt = "";
    this.#poster.draggable = false;
    this.#message.setAttribute("role", "alert");
    const parts = { canvas: this.#canvas, poster: this.#poster, progress: this.#progress, message: this.#message };
    for (const [part, node] of Object.entries(parts)) {
      node.part = part;
      node.hidden = true;
      root.append(node);
    }
    const self = this;
    this.#input = new Input(this, {
      get navigation() { return self.#navigation; },
      moved: () => { this.#rotating = false; this.#redraw(); },
      stepCamera: (step) => this.#stepCamera(step),
      cycleAntiAliasing: () => { this.aa = Object.keys(SAMPLES)[(Object.keys(SAMPLES).indexOf(this.aa) + 1) % 3]; },
    });
    this.#resize = new ResizeObserver((entries) => this.#resized(entries[0]));
    this.#intersection = new IntersectionObserver(([entry]) => {
      this.#visible = entry.isIntersecting;
      this.#stage?.wake();
    });
  }

  // Properties reflect attributes.
  get src() { return this.getAttribute("src") ?? ""; }
  set src(value) { this.setAttribute("src", value); }
  get poster() { return this.getAttribute("poster") ?? ""; }
  set poster(value) { this.setAttribute("poster", value); }
  get camera() { return this.getAttribute("camera") ?? ""; }
  set camera(value) { this.setAttribute("camera", String(value)); }
  get aa() { return this.getAttribute("aa") in SAMPLES ? this.getAttribute("aa") : "msaa"; }
  set aa(value) { this.setAttribute("aa", value); }
  get autorotate() { return this.hasAttribute("autorotate"); }
  set autorotate(value) { this.toggleAttribute("autorotate", Boolean(value)); }

  /** Names of the model's cameras, test views first; empty until it is loaded. */
  get cameras() { return this.#resident?.model?.cameras.map((camera) => camera.name) ?? []; }

  /** True once `src` has been drawn. */
  get loaded() { return !this.#first; }

  connectedCallback() {
    if (!this.hasAttribute("tabindex")) this.tabIndex = 0;
    if (!this.hasAttribute("role")) this.setAttribute("role", "img");
    if (!this.hasAttribute("aria-label")) this.setAttribute("aria-label", "a scene in three dimensions");
    try {
      this.#resize.observe(this, { box: "device-pixel-content-box" });
    } catch {
      this.#resize.observe(this);  // Safari does not support this box
    }
    this.#intersection.observe(this);
    this.#connected = true;
    this.#load();
  }

  disconnectedCallback() {
    this.#connected = false;
    this.#resize.disconnect();
    this.#intersection.disconnect();
    this.#unload();
    this.#stage?.leave(this);
  }

  attributeChangedCallback(name, before, value) {
    if (before === value) return;
    if (name === "poster") this.#showPoster();
    // In HTML, attributes are set before the element is connected; connectedCallback() loads then.
    if (name === "src" && this.#connected) this.#load();
    if (name === "autorotate") this.#rotating = this.autorotate;
    if (name === "camera") this.#guard(() => this.#snapToAttribute());
    this.#redraw();
  }

  // The following are called by the stage.

  /** Called once per display refresh. Draws if something has changed. */
  tick(now) {
    const drawn = this.#drawable();
    if (!drawn || !this.#visible) {
      this.#time = null;
      return;
    }
    const rotates = this.#rotating && !matchMedia("(prefers-reduced-motion: reduce)").matches;
    if (rotates || this.#input.flying) {
      const seconds = this.#time === null ? 0 : Math.min(0.1, (now - this.#time) / 1000);
      if (rotates) this.#navigation.orbit(RADIANS_PER_SECOND * seconds, 0);
      this.#input.fly(seconds);
      this.#time = now;
      this.#redraw();
    } else {
      this.#time = null;
    }
    if (this.#ratio !== devicePixelRatio) this.ratioChanged();
    if (this.#dirty) this.#guard(() => this.#draw(drawn));
  }

  /** Called when the device pixel ratio changes. Not every ResizeObserver reports this. */
  ratioChanged() { this.#fit(this.#box); }

  contextLost() {
    if (this.#navigation) this.#show(LOST);
    this.dispatchEvent(new Event("contextlost"));
  }

  /** @param {Error | null} problem reason if it failed */
  contextRestored(problem) {
    if (problem) return this.#fail(problem);
    if (this.#navigation) this.#show("");
    this.dispatchEvent(new Event("contextrestored"));
    this.#redraw();
  }

  async #load() {
    this.#unload();
    this.#first = true;
    this.#show("");
    this.#showPoster();
    if (!this.src) return;
    this.#progress.removeAttribute("value");
    this.#progress.hidden = false;
    const onProgress = (loaded, total) => this.#showProgress(loaded, total);
    let resident = null;
    try {
      this.#stage ??= theStage();
      this.#stage.join(this);
      // Absolute URLs identify models, however the attribute is written.
      resident = this.#resident =
        this.#stage.take(this.src.startsWith("#") ? this.src : new URL(this.src, document.baseURI).href);
      resident.listeners.add(onProgress);
      await resident.ready;
      if (this.#resident !== resident) return;  // src has changed meanwhile
      this.#navigation = new Navigation(framingOf(resident.model));
      this.#rotating = this.autorotate;
      this.#snapToAttribute();
      this.#redraw();
    } catch (error) {
      if (this.#resident === resident) this.#fail(error);
    } finally {
      resident?.listeners.delete(onProgress);
      if (this.#resident === resident) this.#progress.hidden = true;
    }
  }

  #unload() {
    if (this.#resident) this.#stage.release(this.#resident);
    this.#resident = this.#navigation = this.#cameraIndex = null;
    this.#canvas.hidden = this.#progress.hidden = true;
  }

  /** Selects the camera of the attribute; without it the first test view, as in soup-view. */
  #snapToAttribute() {
    if (!this.#navigation) return;
    const { cameras, name } = this.#resident.model, which = this.camera || "0";
    if (cameras.length === 0) {
      if (this.camera) throw new SoupError(`${name}: has no cameras; remove camera="${which}"`);
      return;
    }
    const index = /^\d+$/.test(which) ? Number(which) : cameras.findIndex((camera) => camera.name === which);
    if (!cameras[index])
      throw new SoupError(
        `${name}: has no camera ${which}; give a name, or a number below ${cameras.length} (from 0)`);
    this.#snapTo(index);
  }

  #snapTo(index) {
    this.#cameraIndex = index;
    this.#navigation.snap(this.#resident.model.cameras[index]);
  }

  #stepCamera(step) {
    const count = this.#resident.model.cameras.length;
    if (count > 0) this.#snapTo(((this.#cameraIndex ?? -step) + step + count) % count);
  }

  /** The model on the GPU; null before it is loaded and while the context is lost. */
  #drawable() { return this.#navigation && this.#stage.renderer ? this.#resident.drawn : null; }

  #draw(drawn) {
    const { width, height } = this.#canvas, { model } = this.#resident;
    if (width === 0 || height === 0) return;
    this.#dirty = false;
    // Views of the dataset are drawn as in the evaluation.
    const exact = this.#navigation.snapped, camera = this.#navigation.camera(width, height);
    const view = exact ? viewOf(camera, model.near, model.far) : viewOf(camera, FREE_NEAR, FREE_FAR);
    this.#stage.draw(this.#context, drawn, view, { aa: this.aa, dropBehind: exact && model.dropNear });
    if (!this.#first) return;
    this.#first = false;
    this.#canvas.hidden = false;
    this.#poster.hidden = true;
    this.dispatchEvent(new Event("load"));
  }

  #redraw() {
    this.#dirty = true;
    this.#stage?.wake();
  }

  #resized(entry) {
    this.#box = entry.contentRect;
    this.#fit(this.#box, entry.devicePixelContentBoxSize?.[0]);
  }

  /**
   * Fits the canvas to the element. device: size in device pixels, if the browser reports it. Emulated screens report
   * wrong values, which are ignored.
   */
  #fit(css, device) {
    this.#ratio = devicePixelRatio;
    const size = [[css.width, device?.inlineSize], [css.height, device?.blockSize]].map(([side, exact]) =>
      Math.abs(side * devicePixelRatio - exact) <= 1 ? exact : Math.round(side * devicePixelRatio));
    // Sizes that exceed the limits of the device are drawn smaller and enlarged.
    const shrink = Math.min(1, (this.#stage?.renderer?.largestSide ?? 4096) / Math.max(1, ...size));
    const [width, height] = size.map((side) => Math.max(1, Math.floor(side * shrink)));
    if (width === this.#canvas.width && height === this.#canvas.height) return;
    this.#canvas.width = width;
    this.#canvas.height = height;
    this.#redraw();
    // Resizing clears the canvas, so it is drawn at once, not at the next refresh.
    const drawn = this.#drawable();
    if (drawn && this.#visible) this.#guard(() => this.#draw(drawn));
  }

  #showPoster() {
    if (this.poster && this.#poster.getAttribute("src") !== this.poster) this.#poster.src = this.poster;
    this.#poster.hidden = !this.poster || !this.#first;
  }

  #showProgress(loaded, total) {
    if (total !== null) this.#progress.value = Math.min(1, loaded / total);
    this.dispatchEvent(new ProgressEvent("progress", { lengthComputable: total !== null, loaded, total: total ?? 0 }));
  }

  #show(text) {
    this.#message.textContent = text;
    this.#message.hidden = text === "";
  }

  /** Shows an error in the element. Errors other than SoupError are bugs and also go to the console. */
  #fail(error) {
    if (!(error instanceof SoupError)) console.error(error);
    const message = error instanceof SoupError ? error.message
      : `the scene cannot be drawn (${error.message}); reload the page`;
    this.#show(message);
    this.dispatchEvent(new ErrorEvent("error", { message, error }));
  }

  #guard(action) {
    try {
      action();
    } catch (error) {
      this.#dirty = false;
      this.#fail(error);
    }
  }
}
