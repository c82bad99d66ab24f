// Mouse, touch, wheel and keys of one element, as in soup-view (docs/viewer.md).

const RADIANS_PER_PIXEL = 0.008, ZOOM_PER_NOTCH = 1.15, PIXELS_PER_NOTCH = 100, LINES_PER_NOTCH = 3;
const ARROW_RADIANS = 0.1;
const TAP_MS = 300, TAP_PIXELS = 10, DOUBLE_TAP_MS = 400, DOUBLE_TAP_PIXELS = 30;
const FLY_KEYS = { KeyD: [1, 0, 0], KeyA: [-1, 0, 0], KeyE: [0, 1, 0], KeyQ: [0, -1, 0], KeyW: [0, 0, 1],
  KeyS: [0, 0, -1] };
const ARROWS = { ArrowLeft: [1, 0], ArrowRight: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
/** What a key does: a name of `commands`, with its arguments. */
const COMMANDS = { KeyX: ["cycleAntiAliasing"], BracketRight: ["stepCamera", 1], PageDown: ["stepCamera", 1],
  BracketLeft: ["stepCamera", -1], PageUp: ["stepCamera", -1], Home: ["firstView"], KeyL: ["copyLink"],
  KeyH: ["help"], Space: ["playOrPause"], Enter: ["fullscreen"] };
/** These belong to a button that has the focus. */
const ACTIVATING = ["Space", "Enter"];

/**
 * @typedef {object} Controlled the object that input controls
 * @property {import("./navigation.js").Navigation | null} navigation null before the model is loaded
 * @property {boolean} interactive false if visitors may not move the camera
 * @property {"auto" | "always" | "modifier" | "never"} wheel
 * @property {() => void} moving called before a change
 * @property {() => void} moved called after every change
 * @property {() => void} wheelRefused called when the wheel scrolls the page instead
 * @property {(x: number, y: number) => void} pivot double click or tap; CSS pixels in the element
 * @property {Record<string, Function>} commands those of COMMANDS; false if one does not apply
 */

/** True if something scrolls with the wheel above the element: its page, a box in it, or the page around a frame. */
function scrolls(element) {
  if (window.parent !== window) return true;
  const page = document.scrollingElement ?? document.documentElement;
  if (page.scrollHeight > page.clientHeight + 1) return true;
  for (let box = element.parentElement; box && box !== page && box !== document.body; box = box.parentElement)
    if (box.scrollHeight > box.clientHeight + 1 && /auto|scroll/.test(getComputedStyle(box).overflowY)) return true;
  return false;
}

/** True if an event comes from a button or a hotspot in the element. */
function isForControl(event, element) {
  const path = event.composedPath();
  return path.slice(0, path.indexOf(element))
    .some((node) => node.matches?.("a, button, input, select, dialog, [slot]"));
}

export class Input {
  #element; #to; #pointers = new Map(); #held = new Set(); #fast = false; #down = null; #tap = null;
  #onPageKey = (event) => this.#pageKeyDown(event);

  /**
   * @param {HTMLElement} element receives the events
   * @param {Controlled} to
   */
  constructor(element, to) {
    this.#element = element;
    this.#to = to;
    element.addEventListener("pointerdown", (event) => this.#pointerDown(event));
    element.addEventListener("pointermove", (event) => this.#pointerMove(event));
    element.addEventListener("pointerup", (event) => this.#pointerUp(event));
    for (const kind of ["pointerup", "pointercancel", "lostpointercapture"])
      element.addEventListener(kind, (event) => this.#pointers.delete(event.pointerId));
    element.addEventListener("contextmenu", (event) => {
      if (this.#to.interactive && !isForControl(event, element)) event.preventDefault();  // the right button pans
    });
    element.addEventListener("wheel", (event) => this.#wheel(event), { passive: false });
    element.addEventListener("keydown", (event) => this.#keyDown(event));
    element.addEventListener("keyup", (event) => this.#keyUp(event));
    element.addEventListener("blur", () => this.#held.clear());
  }

  /** Where the element fills the page, keys work before a click. */
  connect() {
    document.addEventListener("keydown", this.#onPageKey);
    document.addEventListener("keyup", this.#onPageKey);
  }

  disconnect() {
    document.removeEventListener("keydown", this.#onPageKey);
    document.removeEventListener("keyup", this.#onPageKey);
    this.#held.clear();
    this.#pointers.clear();
  }

  /** True while a key for flying is held. */
  get flying() { return this.#held.size > 0; }

  /** Moves the camera for `seconds` according to the held keys. */
  fly(seconds) {
    const { navigation } = this.#to;
    if (!navigation || !this.flying) return;
    const step = 0.5 * Math.min(seconds, 0.1) * (this.#fast ? 4 : 1) * navigation.home.distance;
    const go = [0, 1, 2].map((axis) => [...this.#held].reduce((sum, code) => sum + FLY_KEYS[code][axis], 0));
    navigation.fly(step * go[0], step * go[1], step * go[2]);
  }

  /** The navigation, if it may be moved. */
  get #steered() { return this.#to.interactive ? this.#to.navigation : null; }

  #pointerDown(event) {
    if (!this.#steered || isForControl(event, this.#element)) return;
    this.#element.focus({ preventScroll: true });
    this.#element.setPointerCapture(event.pointerId);
    this.#pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    this.#down = this.#pointers.size === 1 && event.button === 0
      ? { x: event.clientX, y: event.clientY, time: event.timeStamp } : null;
    if (!this.#down) this.#tap = null;
  }

  #pointerMove(event) {
    const before = this.#pointers.get(event.pointerId), navigation = this.#steered;
    if (!before || !navigation) return;
    const now = { x: event.clientX, y: event.clientY }, dx = now.x - before.x, dy = now.y - before.y;
    if (dx === 0 && dy === 0) return;
    const pixels = Math.max(1, this.#element.clientHeight);
    this.#to.moving();
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

  /** Two short taps at one place set the pivot. Browsers report no dblclick for all touches. */
  #pointerUp(event) {
    if (!this.#pointers.has(event.pointerId)) return;
    const from = this.#down, at = { x: event.clientX, y: event.clientY, time: event.timeStamp };
    const apart = (p) => Math.hypot(at.x - p.x, at.y - p.y);
    this.#down = null;
    if (!from || at.time - from.time > TAP_MS || apart(from) > TAP_PIXELS) return;
    const first = this.#tap;
    this.#tap = at;
    if (!first || at.time - first.time > DOUBLE_TAP_MS || apart(first) > DOUBLE_TAP_PIXELS) return;
    this.#tap = null;
    const box = this.#element.getBoundingClientRect();
    if (this.#steered) this.#to.pivot(at.x - box.left, at.y - box.top);
  }

  /** The wheel scrolls the page unless the element was clicked or a modifier is held. */
  #takesWheel(event) {
    const policy = this.#to.wheel, modified = event.ctrlKey || event.metaKey;
    if (policy === "never") return false;
    if (policy === "always" || modified || document.fullscreenElement === this.#element) return true;
    if (policy === "modifier") return false;
    return this.#element.getRootNode().activeElement === this.#element || !scrolls(this.#element);
  }

  #wheel(event) {
    const navigation = this.#steered;
    if (!navigation || isForControl(event, this.#element)) return;
    if (!this.#takesWheel(event)) return this.#to.wheelRefused();
    event.preventDefault();
    this.#to.moving();
    // Trackpads report pinch gestures as wheel events with Ctrl, in small steps.
    const notches = event.deltaMode === WheelEvent.DOM_DELTA_PIXEL
      ? event.deltaY / PIXELS_PER_NOTCH : event.deltaY / LINES_PER_NOTCH;
    navigation.zoom(ZOOM_PER_NOTCH ** (-notches * (event.ctrlKey && Math.abs(notches) < 0.5 ? 5 : 1)));
    this.#to.moved();
  }

  #pageKeyDown(event) {
    if (event.target !== document.body && event.target !== document.documentElement) return;
    const box = this.#element.getBoundingClientRect();
    if (box.width < innerWidth - 1 || box.height < innerHeight - 1) return;
    if (event.type === "keyup") this.#keyUp(event);
    else this.#keyDown(event);
  }

  #keyDown(event) {
    const navigation = this.#steered;
    // Keys with Ctrl, Alt or Meta belong to the browser.
    if (!navigation || event.defaultPrevented || event.ctrlKey || event.altKey || event.metaKey) return;
    const { code } = event;
    if (isForControl(event, this.#element) && (ACTIVATING.includes(code) || event.composedPath()[0].matches("select")))
      return;
    this.#fast = event.shiftKey;
    const move = code in FLY_KEYS ? () => this.#held.add(code)
      : code in ARROWS ? () => navigation.orbit(...ARROWS[code].map((turns) => ARROW_RADIANS * turns))
      : code === "KeyF" ? () => navigation.frame() : code === "KeyR" ? () => navigation.reset() : null;
    if (move) {
      this.#to.moving();
      move();
      this.#to.moved();
    } else if (!(code in COMMANDS) || this.#command(...COMMANDS[code]) === false) {
      return;
    }
    event.preventDefault();
  }

  #command(name, ...values) { return this.#to.commands[name](...values); }

  #keyUp(event) {
    this.#fast = event.shiftKey;
    this.#held.delete(event.code);
  }
}
