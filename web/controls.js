// What visitors can do beside moving the camera: the toolbar, its keys, help and hints. Uses the element's own API.
import { make, showHelp } from "./help.js";
import { SAMPLES } from "./shaders.js";
import { Toolbar, controlsOf } from "./toolbar.js";
import { xrModes } from "./xr.js";

const HINT_MS = 4000;

export class Controls {
  /** What keys and buttons do. Each returns false if it does not apply. */
  commands;
  #element; #root; #toolbar; #hint = make("p", { className: "hint", hidden: true }); #timer = 0;
  #shown = new Set(); #xr = null; #names = null;

  /**
   * @param {import("./element.js").TriSoup} element
   * @param {ShadowRoot} root
   */
  constructor(element, root) {
    this.#element = element;
    this.#root = root;
    this.#hint.part = "hint";
    this.#hint.setAttribute("role", "status");
    this.commands = this.#makeCommands();
    this.#toolbar = new Toolbar(this.commands);
    root.append(this.#toolbar.node, this.#hint);
    for (const event of ["load", "camerachange", "play", "pause", "ended"])
      element.addEventListener(event, () => this.refresh());
    element.addEventListener("load", () => this.#hideHintLater());  // what it says of a link stays until then
    element.addEventListener("fullscreenchange", () => this.#toolbar.setFullscreen(this.#full));
  }

  get #full() { return this.#element.getRootNode().fullscreenElement === this.#element; }

  /** Follows the attribute `controls`. */
  set(value) {
    this.#shown = controlsOf(value);
    this.refresh();
    if (this.#shown.has("xr") && !this.#xr) {
      this.#xr = [];
      xrModes().then((modes) => {
        this.#xr = modes;
        this.refresh();
      });
    }
  }

  get #can() {
    const { loaded, cameras, hasPath, permalink } = this.#element;
    return { scene: loaded, cameras: cameras.length > 1, path: hasPath, reset: true, link: permalink,
      fullscreen: Boolean(document.fullscreenEnabled), help: true, vr: this.#xr?.includes("immersive-vr"),
      ar: this.#xr?.includes("immersive-ar") };
  }

  refresh() {
    const element = this.#element;
    this.#toolbar.show(this.#shown, this.#can);
    if (this.#shown.size === 0 || !element.loaded) return;
    this.#toolbar.setCamera(element.cameraNames, element.camera.index);
    this.#toolbar.setPlaying(!element.paused);
  }

  /** Shows a line for some seconds. Without controls an element shows nothing over its scene. */
  hint(text) {
    if (this.#shown.size === 0) return;
    clearTimeout(this.#timer);
    this.#hint.textContent = text;
    this.#hint.hidden = false;
    if (this.#element.loaded) this.#hideHintLater();
  }

  #hideHintLater() {
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => { this.#hint.hidden = true; }, HINT_MS);
  }

  #has(name) { return this.#shown.has(name) && this.#can[name]; }

  #makeCommands() {
    const element = this.#element;
    return {
      stepCamera: (step) => element.stepCamera(step),
      selectCamera: (index) => element.flyTo(index),
      firstView: () => element.resetCamera(),
      cycleAntiAliasing: () => {
        const levels = Object.keys(SAMPLES);
        element.aa = levels[(levels.indexOf(element.aa) + 1) % levels.length];
        this.hint(`Smooth edges: ${element.aa}`);
      },
      playOrPause: () => {
        if (!element.hasPath) return false;
        if (element.paused) element.play();
        else element.pause();
      },
      copyLink: () => (this.#has("link") ? this.#copyLink() : false),
      enterXR: (mode) => element.enterXR(mode),
      fullscreen: () => (this.#has("fullscreen") ? this.#toggleFullscreen() : false),
      help: () => (this.#has("help") ? showHelp(this.#root,
        { path: element.hasPath, link: this.#has("link"), fullscreen: this.#has("fullscreen") }) : false),
    };
  }

  async #copyLink() {
    try {
      await navigator.clipboard.writeText(this.#element.link);
      this.hint("The link to this view is copied.");
    } catch {
      this.#element.showLink();
      this.hint("Copy the link to this view from the address bar.");
    }
  }

  async #toggleFullscreen() {
    try {
      if (this.#full) await document.exitFullscreen();
      else await this.#element.requestFullscreen();
    } catch {
      this.hint("This browser or page does not allow full screen.");
    }
  }
}
