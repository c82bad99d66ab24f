// The canvas of one element, as many pixels as the device has.

export class Surface {
  canvas = document.createElement("canvas");
  context = this.canvas.getContext("2d", { alpha: false });
  /** Size of the element, CSS pixels. */
  box = { width: 0, height: 0 };
  #element; #to; #observer; #ratio = devicePixelRatio;

  /**
   * @param {HTMLElement} element
   * @param {{resized: () => void, largest: () => number | undefined}} to resized: called when the canvas has another
   *   size, which clears it; largest: side of a canvas that can be drawn, pixels
   */
  constructor(element, to) {
    this.#element = element;
    this.#to = to;
    this.#observer = new ResizeObserver(([entry]) => {
      this.box = entry.contentRect;
      this.#fit(entry.devicePixelContentBoxSize?.[0]);
    });
  }

  connect() {
    try {
      this.#observer.observe(this.#element, { box: "device-pixel-content-box" });
    } catch {
      this.#observer.observe(this.#element);  // Safari does not support this box
    }
  }

  disconnect() { this.#observer.disconnect(); }

  /** Not every ResizeObserver reports another device pixel ratio. */
  checkRatio() { if (this.#ratio !== devicePixelRatio) this.#fit(); }

  /** device: size in device pixels, if the browser reports it. Emulated screens report wrong values: ignored. */
  #fit(device) {
    this.#ratio = devicePixelRatio;
    const sides = [[this.box.width, device?.inlineSize], [this.box.height, device?.blockSize]];
    const size = sides.map(([side, exact]) =>
      Math.abs(side * devicePixelRatio - exact) <= 1 ? exact : Math.round(side * devicePixelRatio));
    // Sizes that exceed the limits of the device are drawn smaller and enlarged.
    const shrink = Math.min(1, (this.#to.largest() ?? 4096) / Math.max(1, ...size));
    const [width, height] = size.map((side) => Math.max(1, Math.floor(side * shrink)));
    if (width === this.canvas.width && height === this.canvas.height) return;
    this.canvas.width = width;
    this.canvas.height = height;
    this.#to.resized();
  }
}
