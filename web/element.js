// <tri-soup>: shows a soup in a page (tri-soup.d.ts describes it).
import { SoupAttributes } from "./attributes.js";
import { aspectOf, centre, forward, fovOf, lookAt, viewOf } from "./camera.js";
import { Controls } from "./controls.js";
import { Cover } from "./cover.js";
import { downloadJson } from "./download.js";
import { SoupError } from "./error.js";
import { Hotspots } from "./hotspots.js";
import { Input } from "./input.js";
import { decodeCamera, encodeCamera, linkValue, linkWith, showLink } from "./permalink.js";
import { pointOnTriangle, rayThrough } from "./pick.js";
import { Rig } from "./rig.js";
import { theStage } from "./stage.js";
import { dress } from "./style.js";
import { Surface } from "./surface.js";
import { add, cross, length, normalize } from "./vectors.js";
import { XrPresenter } from "./xr.js";

const FREE_NEAR = 0.01, FREE_FAR = 10;   // clip planes of a free camera, as in soup-view
const RADIANS_PER_SECOND = 0.25;         // speed of autorotate
const DAMPING = 0.07, FLIGHT_SECONDS = 0.8, PIVOT_SECONDS = 0.4;
const LINK_MS = 300;                     // the address follows the camera when it rests
const LAZY_MARGIN = "300px";             // around the window: a lazy element loads when it comes near
const LOST = "The graphics device was lost. The scene returns with the device; if not, reload the page.";

export class TriSoup extends SoupAttributes {
  static observedAttributes = ["src", "poster", "camera", "aa", "autorotate", "controls", "loading", "path",
    "interaction", "loop", "permalink"];

  #surface = new Surface(this, { resized: () => this.#resized(), largest: () => this.#stage?.renderer?.largestSide });
  #cover = new Cover();
  #hotspots = new Hotspots(this, (error) => this.#complain(error));
  #input; #controls;
  #stage = null;
  #resident = null;       // the model, shown or loading
  #rig = null;            // null until the model is loaded
  #wanted = null;         // camera that a script set before that
  #pathSource = null;     // URL or object of the path that the rig has
  #rotating = false;
  #visible = true;
  #dirty = false;
  #moving = false;
  #connected = false;
  #first = true;          // nothing of this source has been drawn yet
  #time = null;           // of the last tick during an animation
  #seen = "";             // camera of the last camerachange
  #linkTimer = 0;
  #presenter = null;      // while a headset shows the scene
  #intersection;
  #onHash = () => this.#followLink();

  constructor() {
    super();
    const root = this.attachShadow({ mode: "open" });
    dress(root);
    const { canvas } = this.#surface, { poster, progress, message } = this.#cover.parts;
    canvas.part = "canvas";
    canvas.hidden = true;
    root.append(canvas, poster, this.#hotspots.node, progress, message);
    this.#controls = new Controls(this, root);
    this.#input = this.#makeInput();
    this.addEventListener("click", (event) => this.#clickHotspot(event));
    // A busy page is told of several frames at once: the last entry is today's.
    this.#intersection = new IntersectionObserver((entries) => this.#intersects(entries.at(-1).isIntersecting),
      { rootMargin: LAZY_MARGIN });
  }

  #makeInput() {
    const self = this;
    return new Input(this, {
      get navigation() { return self.#rig?.navigation ?? null; },
      get interactive() { return self.interaction !== "none"; },
      get wheel() { return self.wheel; },
      moving: () => {
        this.#rotating = false;
        this.#rig.interrupt();
      },
      moved: () => this.#redraw(),
      wheelRefused: () => this.#controls.hint("Click the scene, or hold Ctrl, to zoom with the wheel."),
      pivot: (x, y) => this.#guard(() => this.#pivot(x, y)),
      commands: this.#controls.commands,
    });
  }

  /** Names of the model's cameras, test views first; empty until it is loaded. */
  get cameras() { return [...this.cameraNames]; }
  /** The same, as one list per model. */
  get cameraNames() { return this.#resident?.model?.names ?? []; }

  /** True once `src` has been drawn. */
  get loaded() { return !this.#first; }

  /** True while the camera moves, or a change of it has not been drawn. */
  get moving() { return Boolean(this.#drawable()) && this.#visible && (this.#dirty || this.#moving); }

  get camera() { return this.#rig?.state ?? null; }
  set camera(value) {
    if (value === null || typeof value !== "object") return this.setAttribute("camera", String(value));
    if (!this.#rig) {
      this.#wanted = value;
      return;
    }
    this.#attempt(() => this.#rig.go(this.#rig.find(value)));
  }

  /** One of the model's cameras, by number or name; null if it has none of them. */
  cameraAt(which) {
    const found = this.#rig ? this.#attempt(() => this.#rig.find(String(which))) : null;
    return found ? this.#rig.stateOf(found) : null;
  }

  /** Moves the camera. @returns {Promise<boolean>} true if it arrives */
  async flyTo(which, { seconds = FLIGHT_SECONDS } = {}) {
    if (!this.#rig) return false;
    this.#rotating = false;
    return this.#attempt(() => this.#rig.go(this.#rig.find(which), this.#calm ? 0 : Number(seconds))) ?? false;
  }

  /** Moves to the next (1) or previous (-1) camera. */
  stepCamera(step) {
    const count = this.cameraNames.length;
    if (count === 0) return Promise.resolve(false);
    return this.flyTo(((this.#rig.lastIndex ?? -step) + step + count) % count);
  }

  /** Moves to the view with which the page starts. */
  resetCamera() {
    if (!this.#rig) return Promise.resolve(false);
    const first = this.#attributeCamera();
    if (first) return this.flyTo(first.index);
    this.#rig.interrupt();
    this.#rig.navigation.reset();
    this.#redraw();
    return Promise.resolve(true);
  }

  get hasPath() { return this.path !== "" || Boolean(this.#rig?.hasPath); }
  get paused() { return !this.#rig?.playing; }
  get duration() { return this.#rig?.duration ?? NaN; }
  get currentTime() { return this.#rig?.time ?? 0; }
  set currentTime(seconds) { this.#attempt(() => { if (this.#rig) this.#rig.time = Number(seconds); }); }

  /** Plays a path. @returns {Promise<boolean>} true if it plays */
  async play(path = this.#pathSource ?? this.path, { dataparser = null } = {}) {
    const rig = this.#rig;
    if (!rig) return false;
    try {
      if (path !== this.#pathSource || !rig.hasPath) await this.#loadPath(rig, path, dataparser);
    } catch (error) {
      this.#complain(error);
      return false;
    }
    if (this.#rig !== rig) return false;  // src has changed meanwhile
    this.#rotating = false;
    rig.loop = this.loop;
    rig.play();
    this.#redraw();
    return true;
  }

  pause() { this.#rig?.pause(); }

  /** Address of the page with the camera that is shown. */
  get link() {
    return this.#rig ? linkWith(this.#linkKey, encodeCamera(this.#rig.state)) : location.href;
  }

  /** Puts the camera into the address of the page. */
  showLink() { if (this.#rig) showLink(this.#linkKey, encodeCamera(this.#rig.state)); }

  /** Shows the scene in a headset. @returns {Promise<boolean>} true if it does */
  async enterXR(mode = "immersive-vr") {
    if (!this.#drawable() || this.#presenter) return false;
    const { navigation } = this.#rig, camera = navigation.reference(), { scale } = this.#resident.model.normalisation;
    const metres = Number(this.getAttribute("xr-scale"));
    const presenter = new XrPresenter(this.#stage, { drawn: () => this.#drawable(), eye: centre(camera),
      ahead: forward(camera), up: navigation.home.up, distance: navigation.distance,
      metresPerUnit: metres > 0 ? metres / scale : null, aa: this.aa, near: FREE_NEAR, far: FREE_FAR });
    this.#presenter = presenter;
    try {
      await presenter.start(mode, () => {
        this.#presenter = null;
        this.dispatchEvent(new Event("xrend"));
        this.#redraw();
      });
    } catch (error) {
      this.#presenter = null;
      this.#complain(error);
      return false;
    }
    this.dispatchEvent(new Event("xrstart"));
    return true;
  }

  exitXR() { this.#presenter?.end(); }

  connectedCallback() {
    if (this.interaction !== "none" && !this.hasAttribute("tabindex")) this.tabIndex = 0;
    if (!this.hasAttribute("aria-label")) this.setAttribute("aria-label", "a scene in three dimensions");
    this.#surface.connect();
    this.#hotspots.connect(() => {
      this.#describe();
      this.#moving = true;  // when it rests, those that something covers are found
      this.#redraw();
    });
    this.#describe();
    this.#input.connect();
    addEventListener("hashchange", this.#onHash);
    this.#connected = true;
    this.#visible = this.loading !== "lazy";
    this.#intersection.observe(this);
    this.#load();
  }

  disconnectedCallback() {
    this.#connected = false;
    this.#surface.disconnect();
    this.#intersection.disconnect();
    this.#hotspots.disconnect();
    this.#input.disconnect();
    removeEventListener("hashchange", this.#onHash);
    clearTimeout(this.#linkTimer);
    this.#unload();
    this.#stage?.leave(this);
  }

  attributeChangedCallback(name, before, value) {
    if (before === value) return;
    if (name === "poster" || name === "loading") this.#showPoster();
    // In HTML, attributes are set before the element is connected; connectedCallback() loads then.
    if ((name === "src" || name === "loading") && this.#connected && (name === "src" || !this.#resident)) this.#load();
    if (name === "autorotate") this.#rotating = this.autorotate;
    if (name === "camera" && this.#rig) this.#showAttributeCamera();
    if (name === "path") this.#pathSource = null;
    if (name === "loop" && this.#rig) this.#rig.loop = this.loop;
    if (name === "controls") this.#controls.set(value);
    if (["controls", "path", "permalink"].includes(name)) this.#controls.refresh();
    if (this.#connected) this.#describe();
    this.#redraw();
  }

  /** The role: a picture, but readers of screens do not find the buttons in a picture. */
  #describe() {
    const own = this.getAttribute("role"), role = this.controls || this.#hotspots.any ? "group" : "img";
    if (own === null || (own !== role && ["img", "group"].includes(own))) this.setAttribute("role", role);
  }

  // The following are called by the stage.

  /** Called once per display refresh. Draws if something has changed. */
  tick(now) {
    const drawn = this.#drawable();
    if (!drawn || !this.#visible || this.#presenter) {
      this.#time = null;
      return;
    }
    const seconds = this.#time === null ? 0 : (now - this.#time) / 1000, calm = this.#calm, rig = this.#rig;
    const rotates = this.#rotating && !calm, moved = this.#moving;
    rig.navigation.damping = calm ? 0 : DAMPING;
    if (rotates) rig.navigation.orbit(RADIANS_PER_SECOND * Math.min(0.1, seconds), 0);
    this.#input.fly(seconds);
    this.#moving = rig.advance(seconds) || rotates || this.#input.flying;
    this.#time = this.#moving ? now : null;
    if (this.#moving) this.#redraw();
    this.#surface.checkRatio();
    if (this.#dirty) this.#guard(() => this.#draw(drawn));
    if (moved && !this.#moving) this.#rested();
  }

  /** True if the visitor prefers no motion. */
  get #calm() { return matchMedia("(prefers-reduced-motion: reduce)").matches; }

  /** Called when the device pixel ratio changes. Not every ResizeObserver reports this. */
  ratioChanged() { this.#surface.checkRatio(); }

  contextLost() {
    if (this.#rig) this.#cover.message = LOST;
    this.dispatchEvent(new Event("contextlost"));
  }

  /** @param {Error | null} problem reason if it failed */
  contextRestored(problem) {
    if (problem) return this.#fail(problem);
    if (this.#rig) this.#cover.message = "";
    this.dispatchEvent(new Event("contextrestored"));
    this.#redraw();
  }

  async #load() {
    this.#unload();
    this.#first = true;
    this.#cover.message = "";
    this.#showPoster();
    this.#controls.refresh();
    if (!this.src || (this.loading === "lazy" && !this.#visible)) return;  // waits until it is near
    this.#cover.loading = true;
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
      resident.model.names ??= resident.model.cameras.map((camera) => camera.name);
      this.#rig = new Rig(resident.model, (event) => this.dispatchEvent(new Event(event)));
      this.#rotating = this.autorotate;
      this.#showFirstView();
      this.#redraw();
      if (this.hasAttribute("autoplay") && this.path && !this.#calm) this.play();
    } catch (error) {
      if (this.#resident === resident) this.#fail(error);
    } finally {
      resident?.listeners.delete(onProgress);
      if (this.#resident === resident) this.#cover.loading = false;
    }
  }

  /** Shows another model of the same scene from the same camera. @returns {Promise<boolean>} true if it is shown */
  async replace(url) {
    const before = this.#resident;
    if (!this.#rig || !before.model) {
      this.src = url;
      return false;
    }
    const next = this.#stage.take(new URL(url, document.baseURI).href);
    try {
      await next.ready;
      if (this.#resident !== before || next === before) throw new SoupError(`${url}: something else is shown by now`);
    } catch (error) {
      this.#stage.release(next);
      if (this.#resident === before) this.#complain(error);
      return false;
    }
    next.model.names ??= next.model.cameras.map((camera) => camera.name);
    this.#resident = next;
    this.#rig.model = next.model;
    this.#stage.release(before);
    this.#redraw();
    return true;
  }

  #unload() {
    this.exitXR();
    this.#rig?.interrupt();
    if (this.#resident) this.#stage.release(this.#resident);
    this.#resident = this.#rig = this.#pathSource = null;
    this.#surface.canvas.hidden = true;
    this.#cover.loading = false;
    this.#moving = false;
    this.#seen = "";
  }

  #intersects(near) {
    this.#visible = near;
    if (near && this.#connected && !this.#resident && this.#first && !this.#cover.message) this.#load();
    this.#stage?.wake();
  }

  /** The camera of the address, or a script's, or the attribute's; without any the first test view, as in soup-view. */
  #showFirstView() {
    const wanted = this.#wanted;
    this.#wanted = null;
    this.#showAttributeCamera();
    if (wanted) this.#attempt(() => this.#rig.go(this.#rig.find(wanted)));
    this.#followLink();
  }

  #attributeCamera() {
    const which = this.getAttribute("camera") ?? "";
    if (this.cameraNames.length === 0 && !which) return null;
    return this.#attempt(() => this.#rig.find(which || "0")) ??
      (this.cameraNames.length > 0 ? this.#rig.find("0") : null);
  }

  #showAttributeCamera() {
    const found = this.#attributeCamera();
    if (found) this.#rig.go(found);
  }

  get #linkKey() { return this.getAttribute("permalink") || "camera"; }

  /** Shows the camera of the address, if it has one. */
  #followLink() {
    const text = this.permalink && this.#rig ? linkValue(this.#linkKey) : null;
    if (text === null) return;
    this.#rotating = false;
    this.#attempt(() => this.#rig.go(this.#cameraOfLink(decodeCamera(text))));
  }

  #cameraOfLink(which) {
    const count = this.cameraNames.length, what = "the link's camera";
    if (typeof which === "number" && which >= count)
      throw new SoupError(`${what} is ${which}, and ${this.#resident.model.name} has ${count}; copy the link again`);
    return this.#rig.find(which, what);
  }

  async #loadPath(rig, path, dataparser) {
    if (!path) throw new SoupError('there is no path to play; set the attribute path="path.json"');
    const read = (given) => (typeof given === "string" ? downloadJson(given) : given);
    const [document, transforms] = await Promise.all([read(path), read(dataparser)]);
    rig.setPath(document, typeof path === "string" ? path : "path", transforms);
    this.#pathSource = path;
  }

  /** Makes the point under a place of the element the one that the camera turns around, and looks at it. */
  #pivot(x, y) {
    const point = this.#pointAt(x, y), { navigation } = this.#rig, camera = navigation.reference();
    if (!point) return;
    const eye = centre(camera), { up } = navigation.home, ahead = add(point, eye, -1), distance = length(ahead);
    if (!(distance > 1e-6) || length(cross(normalize(ahead), up)) < 0.02) return;  // straight above or below
    const aimed = lookAt(eye, point, up, fovOf(camera), 1000 * aspectOf(camera), 1000);
    this.#rig.go({ camera: { ...aimed, distance, free: true }, index: null }, this.#calm ? 0 : PIVOT_SECONDS);
    this.#redraw();
  }

  /** The point of the soup at a place of the element, CSS pixels; null if there is none. */
  #pointAt(x, y) {
    const drawn = this.#drawable();
    if (!drawn || this.#presenter) return null;
    this.#draw(drawn);  // the targets hold the frame that was drawn last, maybe another element's
    return this.#pointDrawn(x, y);
  }

  /** The same, in the frame that was drawn last. */
  #pointDrawn(x, y) {
    const { box, canvas: { width, height } } = this.#surface, view = this.#view();
    const i = Math.floor((x * width) / box.width), j = Math.floor((y * height) / box.height);
    if (!(i >= 0 && j >= 0 && i < width && j < height)) return null;
    const triangle = this.#stage.triangleAt(i, j);
    return triangle === null ? null
      : pointOnTriangle(this.#resident.model.vertices, triangle, view.eye, rayThrough(view, i + 0.5, j + 0.5));
  }

  #clickHotspot(event) {
    const spot = this.#hotspots.of(event);
    if (!spot) return;
    const { slot, dataset } = spot.child, detail = { name: slot, position: spot.position };
    this.dispatchEvent(new CustomEvent("hotspot", { detail }));
    if (dataset.camera !== undefined) this.flyTo(dataset.camera);
  }

  /** Called when the camera has come to rest. */
  #rested() {
    const { model } = this.#resident;
    if (this.#hotspots.any)
      this.#guard(() => {
        this.#draw(this.#drawable());
        this.#hotspots.cover(this.#view().eye, (x, y) => this.#pointDrawn(x, y));
      });
    if (!this.permalink) return;
    clearTimeout(this.#linkTimer);
    this.#linkTimer = setTimeout(() => { if (this.#resident?.model === model) this.showLink(); }, LINK_MS);
  }

  /** The model on the GPU; null before it is loaded and while the context is lost. */
  #drawable() { return this.#rig && this.#stage.renderer ? this.#resident.drawn : null; }

  /** Views of the dataset are drawn as in the evaluation. */
  #view() {
    const { model } = this.#resident, { navigation } = this.#rig;
    const camera = navigation.camera(this.#surface.canvas.width, this.#surface.canvas.height);
    return navigation.exact ? viewOf(camera, model.near, model.far) : viewOf(camera, FREE_NEAR, FREE_FAR);
  }

  #draw(drawn) {
    const { width, height } = this.#surface.canvas, { model } = this.#resident, { exact } = this.#rig.navigation;
    if (width === 0 || height === 0) return;
    this.#dirty = false;
    const view = this.#view();
    this.#stage.draw(this.#surface.context, drawn, view, { aa: this.aa, dropBehind: exact && model.dropNear });
    this.#hotspots.place(view, this.#surface.box, model.normalisation);
    const { pose, fx, fy } = this.#rig.navigation.reference(), seen = [...pose, fx, fy].join();
    const changed = this.#seen !== "" && this.#seen !== seen;
    this.#seen = seen;
    if (this.#first) this.#drawnFirst();
    else if (changed) this.#cameraChanged();
  }

  #drawnFirst() {
    this.#first = false;
    this.#surface.canvas.hidden = false;
    this.#cover.hidePoster();
    this.dispatchEvent(new Event("load"));
    this.#rested();
  }

  #cameraChanged() {
    this.dispatchEvent(new Event("camerachange"));
    if (!this.#moving) this.#rested();
  }

  #redraw() {
    this.#dirty = true;
    this.#stage?.wake();
  }

  /** The canvas has another size, and is empty: it is drawn at once, not at the next refresh. */
  #resized() {
    this.#redraw();
    const drawn = this.#drawable();
    if (drawn && this.#visible) this.#guard(() => this.#draw(drawn));
  }

  #showPoster() { this.#cover.showPoster(this.poster, this.#first, this.loading); }

  #showProgress(loaded, total) {
    if (total !== null) this.#cover.share = loaded / total;
    this.dispatchEvent(new ProgressEvent("progress", { lengthComputable: total !== null, loaded, total: total ?? 0 }));
  }

  /** Shows an error in the element. Errors other than SoupError are bugs and also go to the console. */
  #fail(error) {
    if (!(error instanceof SoupError)) console.error(error);
    const message = error instanceof SoupError ? error.message
      : `the scene cannot be drawn (${error.message}); reload the page`;
    this.#cover.message = message;
    this.dispatchEvent(new ErrorEvent("error", { message, error }));
  }

  /** Reports something that cannot be used. The scene is shown without it. */
  #complain(error) {
    if (!(error instanceof SoupError)) return this.#fail(error);
    console.warn(`<tri-soup>: ${error.message}`);
    this.#controls.hint(error.message);
    this.dispatchEvent(new ErrorEvent("error", { message: error.message, error }));
  }

  /** Does something with what a page or a script gave, then draws. @returns its result; undefined if it fails */
  #attempt(action) {
    try {
      const result = action();
      this.#redraw();
      return result;
    } catch (error) {
      this.#complain(error);
      return undefined;
    }
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
