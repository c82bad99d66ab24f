// Numbers, curves and buttons of the training.
import { drawCurves } from "./curves.js";

const SURE_MS = 4000;

export function duration(seconds) {
  const s = Math.max(0, Math.round(seconds)), two = (n) => String(n).padStart(2, "0");
  return s >= 3600 ? `${Math.floor(s / 3600)}:${two(Math.floor(s / 60) % 60)}:${two(s % 60)}`
    : `${Math.floor(s / 60)}:${two(s % 60)}`;
}

export const bytesText = (bytes) => (bytes >= 1e6 ? `${(bytes / 1e6).toFixed(2)} MB` : `${Math.round(bytes / 1e3)} KB`);

/** What is shown of a state, name by name. */
export function numbersOf(state, points) {
  const last = points.at(-1), test = state.evaluations.at(-1), decimals = (value, n) => Number(value).toFixed(n);
  return [
    ["Step", state.steps > 0 && `${state.step} of ${state.steps}`],
    ["Time left", !state.ended && state.steps > 0 && duration(state.seconds_left)],
    ["Triangles", state.triangles > 0 && state.triangles.toLocaleString("en")],
    ["Model as sent", state.bytes > 0 && bytesText(state.bytes)],
    ["PSNR, training views", last && last[2] !== null && `${decimals(last[2], 2)} dB`],
    ["PSNR, test views", test && `${decimals(test[1], 2)} dB`],
    ["SSIM, test views", test && decimals(test[2], 4)],
    ["Loss", last && decimals(last[1], 4)],
    ["Step's time", state.ms_per_step > 0 && `${decimals(state.ms_per_step, state.ms_per_step < 10 ? 2 : 0)} ms`],
  ].filter(([, text]) => text);
}

export class Panel {
  #feed; #node; #sure = 0;

  /** @param {(id: string) => HTMLElement} node */
  constructor(node) {
    this.#node = node;
    node("pause").addEventListener("click", () => this.#feed.control(this.#feed.state?.paused ? "continue" : "pause"));
    node("save").addEventListener("click", () => this.#feed.control("save"));
    node("stop").addEventListener("click", () => this.#stop());
  }

  set feed(feed) { this.#feed = feed; }
  set control(control) { this.#node("buttons").hidden = !control; }

  #stop() {
    const button = this.#node("stop");
    clearTimeout(this.#sure);
    if (button.classList.toggle("sure")) {
      button.textContent = "Really stop";
      this.#sure = setTimeout(() => this.#calm(), SURE_MS);
      return;
    }
    this.#calm();
    this.#feed.control("stop");
  }

  #calm() {
    this.#node("stop").classList.remove("sure");
    this.#node("stop").textContent = "Stop";
  }

  #say(text, problem = false) {
    this.#node("phase").textContent = text;
    this.#node("phase").classList.toggle("problem", problem);
  }

  show(state, points) {
    const node = this.#node;
    this.#say(state.error || (state.paused ? "paused" : state.phase), Boolean(state.error));
    node("progress").value = state.steps > 0 ? Math.min(1, state.step / state.steps) : 0;
    node("numbers").replaceChildren(...numbersOf(state, points).flatMap(([name, text]) =>
      [["dt", name], ["dd", text]].map(([tag, content]) =>
        Object.assign(document.createElement(tag), { textContent: content }))));
    node("pause").textContent = state.paused ? "Continue" : "Pause";
    for (const id of ["pause", "save", "stop"]) node(id).disabled = state.ended || state.steps === 0;
    node("message").textContent = state.message;
    node("download").hidden = state.model === 0;
    this.draw(state, points);
  }

  draw(state, points) {
    const steps = state.steps || 1;
    drawCurves(this.#node("psnr"), [
      { points: points.filter(([, , psnr]) => psnr !== null).map(([step, , psnr]) => [step, psnr]), colour: "--train" },
      { points: state.evaluations.map(([step, psnr]) => [step, psnr]), colour: "--test", dots: true },
    ], { steps });
    drawCurves(this.#node("loss"), [{ points: points.map(([step, loss]) => [step, loss]), colour: "--train" }],
      { steps, log: true });
  }

  /** The server does not answer. */
  silent(state) {
    for (const id of ["pause", "save", "stop"]) this.#node(id).disabled = true;
    if (state?.ended) return;
    this.#say("The training does not answer: it has ended, or the connection is gone. soup-view --serve OUT shows a " +
      "finished training.", true);
  }
}
