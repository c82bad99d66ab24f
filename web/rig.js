// The camera of one soup over time: navigation by hand, animated changes, and paths that are played.
import { framingOf } from "./camera.js";
import { SoupError } from "./error.js";
import { Navigation } from "./navigation.js";
import { readPath } from "./path.js";
import { cameraOf, stateOf } from "./pose.js";
import { arc, cameraOfShot, eased, shotAt, shotOf } from "./shot.js";
import { clamp } from "./vectors.js";

const MOST_SECONDS = 0.1;  // of one step: a page in the background gets no frames

export class Rig {
  #model; #index = null; #flight = null; #path = null; #time = 0; #playing = false; #notify;

  /**
   * @param {import("./model.js").Model} model
   * @param {(event: string) => void} notify called with "play", "pause", "timeupdate" and "ended"
   */
  constructor(model, notify) {
    this.#model = model;
    this.#notify = notify;
    this.navigation = new Navigation(framingOf(model));
  }

  /** Number of the model's camera that is shown exactly; null if it is none. */
  get index() { return this.navigation.exact ? this.#index : null; }
  /** Number of the camera that was selected last, for steps from it; null before the first. */
  get lastIndex() { return this.#index; }
  get flying() { return this.#flight !== null; }

  /** Position, target, ... in the world: see tri-soup.d.ts. */
  get state() {
    const { navigation } = this, { normalisation, cameras } = this.#model, { index } = this;
    return { ...stateOf(navigation.reference(), navigation.distance, normalisation), index,
      name: index === null ? null : cameras[index].name };
  }

  /** The same of what find() returns. */
  stateOf({ camera, index }) {
    const navigation = new Navigation(this.navigation.home);
    navigation.snap(camera);
    return { ...stateOf(navigation.reference(), navigation.distance, this.#model.normalisation), index,
      name: index === null ? null : this.#model.cameras[index].name };
  }

  /** Another model of the same scene. */
  set model(model) { this.#model = model; }

  #context(what) {
    return { normalisation: this.#model.normalisation, up: this.navigation.home.up, what };
  }

  /**
   * The camera that a number, a name or an object means.
   * @returns {{camera: import("./camera.js").Camera, index: number | null}}
   * @throws {SoupError} if there is none
   */
  find(which, what = "camera") {
    if (typeof which === "object") return { camera: cameraOf(which, this.state, this.#context(what)), index: null };
    const { cameras, name } = this.#model, text = String(which);
    if (cameras.length === 0)
      throw new SoupError(`${name}: has no cameras; remove ${what}="${text}"`);
    const index = /^\d+$/.test(text) ? Number(text) : cameras.findIndex((camera) => camera.name === text);
    if (!cameras[index])
      throw new SoupError(`${name}: has no ${what} ${text}; give a name, or a number below ${cameras.length} (from 0)`);
    return { camera: cameras[index], index };
  }

  /**
   * Changes the camera, at once or in some seconds. The promise says whether it arrives.
   * @param {ReturnType<Rig["find"]>} found
   * @returns {Promise<boolean>}
   */
  go({ camera, index }, seconds = 0) {
    this.interrupt();
    const { navigation } = this;
    if (index !== null) this.#index = index;
    if (!(seconds > 0)) {
      navigation.snap(camera);
      return Promise.resolve(true);
    }
    const from = shotOf(navigation.reference(), navigation.distance);
    navigation.snap(camera);
    const to = shotOf(camera, navigation.distance);
    navigation.snap(cameraOfShot(from));
    return new Promise((resolve) => { this.#flight = { from, to, camera, seconds, time: 0, resolve }; });
  }

  /** Ends an animated change where it is. */
  #land() {
    this.#flight?.resolve(false);
    this.#flight = null;
  }

  /** Ends an animated change where it is, and pauses a path: the visitor or a script moves the camera now. */
  interrupt() {
    this.#land();
    this.pause();
  }

  /** @param {object} document see readPath @throws {SoupError} if it is no path */
  setPath(document, what, dataparser = null) {
    const pivot = (camera) => {
      const home = new Navigation(this.navigation.home);
      home.snap(camera);
      return home.distance;
    };
    this.#path = readPath(document, what, { ...this.#context(what), now: this.state, pivot, dataparser });
    this.#time = 0;
  }

  get hasPath() { return this.#path !== null; }
  get duration() { return this.#path?.seconds ?? NaN; }
  get playing() { return this.#playing; }
  get time() { return this.#time; }
  set time(seconds) {
    if (!Number.isFinite(seconds)) throw new SoupError(`currentTime is ${seconds}; give seconds`);
    if (!this.#path) return;
    this.#land();
    this.#time = clamp(seconds, 0, this.#path.seconds);
    this.#showPath();
  }

  play() {
    if (!this.#path || this.#playing) return;
    if (this.#time >= this.#path.seconds) this.#time = 0;
    this.#land();
    this.#playing = true;
    this.#notify("play");
    this.#showPath();
  }

  pause() {
    if (!this.#playing) return;
    this.#playing = false;
    this.#notify("pause");
  }

  /** Moves on by some seconds. @returns {boolean} true if the camera moves */
  advance(seconds) {
    const step = Math.min(seconds, MOST_SECONDS);
    if (this.#flight) this.#fly(step);
    else if (this.#playing) this.#follow(step);
    else return this.navigation.settle(step);
    return true;
  }

  #fly(step) {
    const flight = this.#flight, t = Math.min(1, (flight.time += step) / flight.seconds);
    this.navigation.snap(t < 1 ? cameraOfShot(arc(flight.from, flight.to, eased(t))) : flight.camera);
    if (t < 1) return;
    this.#flight = null;
    flight.resolve(true);
  }

  #follow(step) {
    const { seconds, loop } = this.#path;
    this.#time += step;
    const over = this.#time >= seconds;
    if (over) this.#time = (loop || this.loop) && seconds > 0 ? this.#time % seconds : seconds;
    this.#showPath();
    if (!over || this.#time < seconds) return;
    this.#playing = false;
    this.#notify("ended");
  }

  #showPath() {
    this.navigation.snap(cameraOfShot(shotAt(this.#path.keys, this.#time)));
    this.#notify("timeupdate");
  }
}
