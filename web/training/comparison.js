// The photograph of a camera beside the rendering: alone, behind a slider, or subtracted.
export const MODES = ["rendering", "photograph", "slider", "error"];

export class Comparison {
  #mode = "rendering"; #camera = null; #nodes; #about = []; #buttons;

  /** @param {{stage, soup, photograph, divider, buttons: Iterable<HTMLElement>}} nodes */
  constructor(nodes) {
    this.#nodes = nodes;
    this.#buttons = [...nodes.buttons];
    for (const button of this.#buttons) button.addEventListener("click", () => { this.mode = button.dataset.mode; });
    nodes.divider.addEventListener("input", () => this.#clip());
    new ResizeObserver(() => this.#fit()).observe(nodes.stage.parentElement);
    this.#show();
  }

  /** @param {{width: number, height: number, photograph: boolean}[]} cameras */
  set about(cameras) {
    this.#about = cameras;
    this.#show();
  }

  get mode() { return this.#mode; }
  set mode(mode) {
    this.#mode = mode;
    this.#show();
  }

  /** The next mode. */
  step() { this.mode = MODES[(MODES.indexOf(this.#mode) + 1) % MODES.length]; }

  /** Number of the camera that is shown exactly; null if it is none. */
  set camera(camera) {
    if (camera === this.#camera) return;
    this.#camera = camera;
    this.#show();
  }

  get #has() { return this.#camera !== null && Boolean(this.#about[this.#camera]?.photograph); }

  #show() {
    const { stage, photograph, divider } = this.#nodes, compares = this.#has && this.#mode !== "rendering";
    stage.dataset.mode = compares ? this.#mode : "rendering";
    photograph.hidden = !compares;
    divider.hidden = !(compares && this.#mode === "slider");
    if (compares) photograph.src = `photograph.webp?camera=${this.#camera}`;
    for (const button of this.#buttons) {
      button.setAttribute("aria-checked", String(button.dataset.mode === this.#mode));
      button.disabled = button.dataset.mode !== "rendering" && !this.#has;
    }
    this.#clip();
    this.#fit();
  }

  #clip() {
    const { photograph, divider } = this.#nodes;
    photograph.style.clipPath = divider.hidden ? "" : `inset(0 ${100 - divider.value / 10}% 0 0)`;
  }

  /** The stage has the shape of the photograph, so that both cover each other. */
  #fit() {
    const { stage } = this.#nodes, shape = this.#nodes.photograph.hidden ? null : this.#about[this.#camera];
    stage.style.width = stage.style.height = "";
    if (!shape) return;
    const { clientWidth: width, clientHeight: height } = stage;
    const scale = Math.min(width / shape.width, height / shape.height);
    stage.style.width = `${scale * shape.width}px`;
    stage.style.height = `${scale * shape.height}px`;
  }
}
