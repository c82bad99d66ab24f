// Mouse, touch, wheel and keys of one element, as in soup-view (docs/viewer.md).

const RADIANS_PER_PIXEL = 0.008, ZOOM_PER_NOTCH = 1.15, PIXELS_PER_NOTCH = 100, LINES_PER_NOTCH = 3;
const ARROW_RADIANS = 0.1;
const FLY_KEYS = { KeyD: [1, 0, 0], KeyA: [-1, 0, 0], KeyE: [0, 1, 0], KeyQ: [0, -1, 0], KeyW: [0, 0, 1],
  KeyS: [0, 0, -1] };
const ARROWS = { ArrowLeft: [1, 0], ArrowRight: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

/**
 * @typedef {object} Controlled the object that input controls
 * @property {import("./camera.js").Navigation | null} navigation null before the model is loaded
 * @property {() => void} moved called after every change
 * @property {(step: number) => void} stepCamera selects the next (1) or previous (-1) camera
 * @property {() => void} cycleAntiAliasing
 */

export class Input {
  #element; #to; #pointers = new Map(); #held = new Set(); #fast = false;

  /**
   * @param {HTMLElement} element receives the events
   * @param {Controlled} to
   */
  constructor(element, to) {
    this.#element = element;
    this.#to = to;
    element.addEventListener("pointerdown", (event) => this.#pointerDown(event));
    element.addEventListener("pointermove", (event) => this.#pointerMove(event));
    for (const kind of ["pointerup", "pointercancel", "lostpointercapture"])
      element.addEventListener(kind, (event) => this.#pointers.delete(event.pointerId));
    element.addEventListener("contextmenu", (event) => event.preventDefault());  // the right button pans
    element.addEventListener("wheel", (event) => this.#wheel(event), { passive: false });
    element.addEventListener("keydown", (event) => this.#keyDown(event));
    element.addEventListener("keyup", (event) => this.#keyUp(event));
    element.addEventListener("blur", () => this.#held.clear());
  }

  /** True while a key for flying is held. */
  get flying() { return this.#held.size > 0; }

  /** Moves the camera for `seconds` according to the held keys. */
  fly(seconds) {
    const { navigation } = this.#to;
    if (!navigation) return;
    const step = 0.5 * Math.min(seconds, 0.1) * (this.#fast ? 4 : 1) * navigation.home.distance;
    const go = [0, 1, 2].map((axis) => [...this.#held].reduce((sum, code) => sum + FLY_KEYS[code][axis], 0));
    navigation.fly(step * go[0], step * go[1], step * go[2]);
  }

  #pointerDown(event) {
    if (!this.#to.navigation) return;
    this.#element.focus({ preventScroll: true });
    this.#element.setPointerCapture(event.pointerId);
    this.#pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
  }

  #pointerMove(event) {
    const before = this.#pointers.get(event.pointerId), { navigation } = this.#to;
    if (!before || !navigation) return;
    const now = { x: event.clientX, y: event.clientY }, dx = now.x - before.x, dy = now.y - before.y;
    const pixels = Math.max(1, this.#element.clientHeight);
    if (this.#pointers.size === 1) {
      // Bits of event.buttons: 1 left, 2 right, 4 middle.
      if (event.buttons & 6 || event.shiftKey) navigation.pan(-dx / pixels, dy / pixels);
      else if (event.ctrlKey) navigation.look(-RADIANS_PER_PIXEL * dx, RADIANS_PER_PIXEL * dy);
      else navigation.orbit(-RADIANS_PER_PIXEL * dx, RADIANS_PER_PIXEL * dy);
    } else if (this.#pointers.size === 2) {
      // Each finger has its own events, so the point between the fingers moves by half of the distance.
      const other = [...this.#pointers.entries()].find(([id]) => id !== event.pointerId)[1];
      const apart = (p) => Math.max(1, Math.hypot(p.x - other.x, p.y - other.y));
      navigation.pan((-0.5 * dx) / pixels, (0.5 * dy) / pixels);
      navigation.zoom(apart(now) / apart(before));
    }
    this.#pointers.set(event.pointerId, now);
    this.#to.moved();
  }

  #wheel(event) {
    const { navigation } = this.#to;
    if (!navigation) return;
    event.preventDefault();
    // Trackpads report pinch gestures as wheel events with Ctrl, in small steps.
    const notches = event.deltaMode === WheelEvent.DOM_DELTA_PIXEL
      ? event.deltaY / PIXELS_PER_NOTCH : event.deltaY / LINES_PER_NOTCH;
    navigation.zoom(ZOOM_PER_NOTCH ** (-notches * (event.ctrlKey ? 5 : 1)));
    this.#to.moved();
  }

  #keyDown(event) {
    const { navigation } = this.#to;
    // Keys with Ctrl, Alt or Meta belong to the browser.
    if (!navigation || event.ctrlKey || event.altKey || event.metaKey) return;
    this.#fast = event.shiftKey;
    if (event.code in FLY_KEYS) this.#held.add(event.code);
    else if (event.code in ARROWS) navigation.orbit(...ARROWS[event.code].map((turns) => ARROW_RADIANS * turns));
    else if (event.code === "KeyF") navigation.frame();
    else if (event.code === "KeyR") navigation.reset();
    else if (event.code === "KeyX") this.#to.cycleAntiAliasing();
    else if (event.code === "BracketRight" || event.code === "PageDown") this.#to.stepCamera(1);
    else if (event.code === "BracketLeft" || event.code === "PageUp") this.#to.stepCamera(-1);
    else return;
    event.preventDefault();
    this.#to.moved();
  }

  #keyUp(event) {
    this.#fast = event.shiftKey;
    this.#held.delete(event.code);
  }
}
