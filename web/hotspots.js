// Labels at places of the scene: children of <tri-soup> with slot="hotspot-..." (tri-soup.d.ts describes them).
import { SoupError } from "./error.js";
import { make } from "./help.js";
import { numbersOf, shortText, toModelPoint } from "./pose.js";
import { add, dot, length } from "./vectors.js";

const COVERED = 0.02;  // share of the distance by which something must lie before a hotspot to cover it

const listOf = (text) => text.trim().split(/[\s,]+/).map((part) => (part === "" ? NaN : Number(part)));

export class Hotspots {
  /** Their container. */
  node = make("div", { className: "spots" });
  #host; #complain; #spots = []; #observer;

  /**
   * @param {HTMLElement} host
   * @param {(error: SoupError) => void} complain called with what is wrong with a hotspot; the others are shown
   */
  constructor(host, complain) {
    this.#host = host;
    this.#complain = complain;
    this.#observer = new MutationObserver(() => this.#changed());
  }

  /** Watches the children; changed: called after they changed. */
  connect(changed) {
    this.changed = changed;
    this.#observer.observe(this.#host, { childList: true, subtree: true, attributes: true,
      attributeFilter: ["slot", "data-position", "data-normal"] });
    this.#read();
  }

  disconnect() { this.#observer.disconnect(); }

  get any() { return this.#spots.length > 0; }

  #changed() {
    this.#read();
    this.changed();
  }

  #read() {
    const children = [...this.#host.children].filter((child) => child.slot.startsWith("hotspot"));
    this.#spots = children.flatMap((child) => this.#spotOf(child) ?? []);
    this.node.replaceChildren(...this.#spots.map((spot) => spot.box));
  }

  #spotOf(child) {
    const { slot, dataset } = child, old = this.#spots.find((spot) => spot.child === child);
    const text = `${slot} ${dataset.position} ${dataset.normal}`;
    if (old?.text === text) return old;
    try {
      if (dataset.position === undefined)
        throw new SoupError(`${slot}: has no data-position; give data-position="x y z"`);
      const position = numbersOf(listOf(dataset.position), 3, `${slot}: data-position ${shortText(dataset.position)}`);
      const normal = dataset.normal === undefined ? null
        : numbersOf(listOf(dataset.normal), 3, `${slot}: data-normal ${shortText(dataset.normal)}`);
      const box = make("div", { hidden: true }, make("slot", { name: slot }));
      return { child, text, position, normal, box, turned: false, covered: false };
    } catch (error) {
      // After the constructor of the element: its page may add listeners first.
      queueMicrotask(() => this.#complain(error));
      return null;
    }
  }

  /**
   * Puts them where they are in a view. size: of the element, CSS pixels
   * @param {import("./camera.js").View} view
   */
  place(view, size, normalisation) {
    const m = view.clipFromWorld;
    for (const spot of this.#spots) {
      const p = toModelPoint(spot.position, normalisation);
      const [x, y, w] = [0, 1, 3].map((i) => m[i] * p[0] + m[4 + i] * p[1] + m[8 + i] * p[2] + m[12 + i]);
      spot.at = [((x / w + 1) / 2) * size.width, ((y / w + 1) / 2) * size.height];
      spot.point = p;
      const inside = w > 0 && Math.abs(x) <= w && Math.abs(y) <= w;
      spot.box.hidden = !inside;
      if (!inside) continue;
      spot.box.style.transform = `translate(${spot.at.map((v) => `${v.toFixed(2)}px`).join()}) translate(-50%, -50%)`;
      spot.turned = spot.normal !== null && dot(spot.normal, add(view.eye, p, -1)) < 0;
      spot.box.classList.toggle("far", spot.turned || spot.covered);
    }
  }

  /**
   * Fades those that something covers.
   * @param {(x: number, y: number) => number[] | null} pointAt what is at a place of the element, CSS pixels
   */
  cover(eye, pointAt) {
    for (const spot of this.#spots.filter(({ box }) => !box.hidden)) {
      const before = pointAt(...spot.at), far = (p) => length(add(p, eye, -1));
      spot.covered = before !== null && far(before) < (1 - COVERED) * far(spot.point);
      spot.box.classList.toggle("far", spot.turned || spot.covered);
    }
  }

  /** The hotspot of an event; null if it comes from elsewhere. */
  of(event) {
    const path = event.composedPath();
    return this.#spots.find((spot) => path.includes(spot.child)) ?? null;
  }
}
