// Thumbnails of the photographs in a row.
export class Strip {
  #node; #buttons = []; #choose; #selected = null; #nearest = null;

  /** @param {(camera: number) => void} choose called with the camera of a photograph that was clicked */
  constructor(node, choose) {
    this.#node = node;
    this.#choose = choose;
  }

  /** @param {{name: string, test: boolean, photograph: boolean}[]} cameras */
  set(cameras) {
    this.#buttons = cameras.map(({ name, test, photograph }, i) => {
      const button = document.createElement("button"), label = document.createElement("span");
      button.type = "button";
      button.role = "option";
      button.title = test ? `${name} (test view)` : name;
      button.classList.toggle("test", test);
      label.textContent = test ? `${i} test` : String(i);
      if (photograph) {
        const picture = new Image();
        picture.loading = "lazy";
        picture.alt = name;
        picture.src = `thumbnail.webp?camera=${i}`;
        button.append(picture);
      }
      button.append(label);
      button.addEventListener("click", () => this.#choose(i));
      return button;
    });
    this.#node.replaceChildren(...this.#buttons);
    this.#selected = this.#nearest = null;
  }

  /** The camera that is shown; null if it is none. */
  set selected(camera) {
    if (camera === this.#selected) return;
    this.#buttons[this.#selected]?.setAttribute("aria-selected", "false");
    this.#buttons[camera]?.setAttribute("aria-selected", "true");
    this.#selected = camera;
    this.#reveal(camera);
  }

  /** The camera that is nearest to the view. */
  set nearest(camera) {
    if (camera === this.#nearest) return;
    this.#buttons[this.#nearest]?.classList.remove("nearest");
    this.#buttons[camera]?.classList.add("nearest");
    this.#nearest = camera;
    this.#reveal(camera);
  }

  /** Scrolls the row alone, not the page. */
  #reveal(camera) {
    const button = this.#buttons[camera];
    if (button) this.#node.scrollLeft = button.offsetLeft - (this.#node.clientWidth - button.offsetWidth) / 2;
  }
}
