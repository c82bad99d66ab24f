// What the server says of the training, asked about once a second while the page is visible. So a training that nobody
// looks at has nothing to do.
const ASK_MS = 1000, RESTS_MS = 5000;

export class Feed {
  /** All points of the curves so far: [step, loss, PSNR or null]. */
  points = [];
  state = null;
  #about = 0; #timer = 0; #asking = false; #told;

  /**
   * @param {{about: (about: object) => void, state: (state: object) => void, silent: (state: ?object) => void}} told
   *   called with news; silent: the server does not answer
   */
  constructor(told) {
    this.#told = told;
    document.addEventListener("visibilitychange", () => this.ask());
    this.ask();
  }

  /** Asks at once. */
  async ask() {
    clearTimeout(this.#timer);
    if (document.hidden || this.#asking) return;
    this.#asking = true;
    try {
      await this.#take(await read(`state.json?from=${this.points.length}`));
    } catch {
      this.#told.silent(this.state);
    }
    this.#asking = false;
    this.#timer = setTimeout(() => this.ask(), this.state?.ended ? RESTS_MS : ASK_MS);
  }

  async #take(state) {
    if (this.state && state.step < this.state.step) return location.reload();  // another training at this address
    this.points.push(...state.points);
    this.state = state;
    if (state.about !== this.#about) this.#told.about(await read("about.json"));
    this.#about = state.about;
    this.#told.state(state);
  }

  /** Has the training "pause", "continue", "stop" or "save". @returns {Promise<boolean>} whether it does */
  async control(action) {
    try {
      const { ok } = await fetch(action, { method: "POST" });
      this.ask();
      return ok;
    } catch {
      return false;
    }
  }
}

async function read(url) {
  const response = await fetch(url);
  if (!response.ok) throw new Error(`${url}: ${response.status}`);
  return response.json();
}
