// What an element shows before and instead of its scene: a poster, the progress of loading, a message.

export class Cover {
  #poster = document.createElement("img");
  #progress = document.createElement("progress");
  #message = document.createElement("p");

  constructor() {
    this.#poster.alt = "";
    this.#poster.draggable = false;
    this.#message.setAttribute("role", "alert");
    this.#message.className = "message";
    for (const [part, node] of Object.entries(this.parts)) {
      node.part = part;
      node.hidden = true;
    }
  }

  get parts() { return { poster: this.#poster, progress: this.#progress, message: this.#message }; }

  /** The picture to show; hidden if the source is empty. loading: "lazy" or "eager" */
  showPoster(source, shown, loading) {
    this.#poster.loading = loading;
    if (source && this.#poster.getAttribute("src") !== source) this.#poster.src = source;
    this.#poster.hidden = !source || !shown;
  }

  hidePoster() { this.#poster.hidden = true; }

  /** Shows that loading has begun, or has ended. */
  set loading(value) {
    if (value) this.#progress.removeAttribute("value");
    this.#progress.hidden = !value;
  }

  /** Share of the model that has been loaded. */
  set share(value) { this.#progress.value = Math.min(1, value); }

  /** A line over the scene; empty: none. */
  get message() { return this.#message.textContent; }
  set message(text) {
    this.#message.textContent = text;
    this.#message.hidden = text === "";
  }
}
