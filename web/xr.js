// Shows a scene in a headset (WebXR), one view per eye.
import { viewOf } from "./camera.js";
import { SoupError } from "./error.js";
import { add, cross, dot, normalize, times } from "./vectors.js";

const MODES = ["immersive-vr", "immersive-ar"];
/** Metres between the visitor and the target at the start, unless the page gives a scale. */
const START_METRES = 2;

/** The kinds of sessions that browser and device support. */
export async function xrModes() {
  const supported = await Promise.all(MODES.map((mode) =>
    Promise.resolve(navigator.xr?.isSessionSupported(mode)).then(Boolean, () => false)));
  return MODES.filter((_, i) => supported[i]);
}

/**
 * The pinhole camera of an eye.
 * @param {ArrayLike<number>} projection column-major, OpenGL
 * @param {ArrayLike<number>} matrix eye to the room, column-major, OpenGL axes, metres
 * @param {{axes: number[][], origin: number[], scale: number}} room its axes x, y, z and its origin in the model, and
 *   model units per metre
 * @returns {import("./camera.js").Camera}
 */
export function eyeCamera(projection, matrix, { axes, origin, scale }, width, height) {
  const column = (i) => [0, 1, 2].map((axis) => matrix[4 * i + axis]);
  const inModel = (d) => add(add(times(axes[0], d[0]), axes[1], d[1]), axes[2], d[2]);
  // OpenGL has y up and z backward, cameras have y down and z forward.
  const [x, y, z] = [inModel(column(0)), times(inModel(column(1)), -1), times(inModel(column(2)), -1)];
  const eye = add(origin, inModel(column(3)), scale);
  return { width, height, fx: 0.5 * width * projection[0], fy: 0.5 * height * projection[5],
    cx: 0.5 * width * (1 - projection[8]), cy: 0.5 * height * (1 + projection[9]),
    pose: [x, y, z].flatMap((axis) => [...axis, -dot(axis, eye)]) };
}

/** The visitor's room in the model: level, before the camera that is shown now. */
export function roomBefore(eye, ahead, up, scale) {
  const side = cross(ahead, up), x = Math.hypot(...side) > 1e-6 ? normalize(side) : normalize(cross([1, 0.1, 0.2], up));
  return { axes: [x, up, cross(x, up)], origin: eye, scale };
}

export class XrPresenter {
  #stage; #session = null; #layer = null; #space = null; #scene; #room = null;

  /**
   * @param {object} stage
   * @param {{drawn: () => object | null, eye: number[], ahead: number[], up: number[], distance: number,
   *   metresPerUnit: number | null, aa: string, near: number, far: number}} scene drawn: the model on the GPU; the
   *   camera with which it starts, normalised; metresPerUnit: of normalised units
   */
  constructor(stage, scene) {
    this.#stage = stage;
    this.#scene = scene;
    this.#room = roomBefore(scene.eye, scene.ahead, scene.up,
      scene.metresPerUnit ? 1 / scene.metresPerUnit : scene.distance / START_METRES);
  }

  /** @param {string} mode of MODES @param {() => void} ended called when the session ends */
  async start(mode, ended) {
    if (!navigator.xr) throw new SoupError("this browser has no WebXR; use a browser of a headset, over https");
    let session;
    try {
      session = await navigator.xr.requestSession(mode, { optionalFeatures: ["local-floor"] });
    } catch (error) {
      throw new SoupError(`the headset does not start (${error.message}); connect it, and allow its use for this page`);
    }
    session.addEventListener("end", () => {
      this.#session = null;
      ended();
    });
    try {
      this.#session = session;
      const { gl } = this.#stage;
      await gl.makeXRCompatible?.();
      this.#layer = new XRWebGLLayer(session, gl, { antialias: false, depth: false, stencil: false });
      await session.updateRenderState({ baseLayer: this.#layer });
      // "local" has its origin at the eyes of the visitor at the start.
      this.#space = await session.requestReferenceSpace("local");
      this.#clear = mode === "immersive-ar";
      session.requestAnimationFrame((time, frame) => this.#draw(frame));
    } catch (error) {
      session.end();
      throw new SoupError(`the headset cannot show the scene (${error.message}); reload the page`);
    }
  }

  #clear = false;

  end() { return this.#session?.end(); }

  #draw(frame) {
    if (!this.#session) return;
    this.#session.requestAnimationFrame((time, next) => this.#draw(next));
    const pose = frame.getViewerPose(this.#space), drawn = this.#scene.drawn(), { renderer } = this.#stage;
    if (!pose || !drawn || !renderer) return;
    const { framebuffer, framebufferHeight } = this.#layer;
    for (const view of pose.views) {
      const { x, y, width, height } = this.#layer.getViewport(view);
      if (width === 0 || height === 0) continue;
      const camera = eyeCamera(view.projectionMatrix, view.transform.matrix, this.#room, width, height);
      renderer.draw(drawn, viewOf(camera, this.#scene.near, this.#scene.far), { aa: this.#scene.aa, dropBehind: false,
        left: x, top: framebufferHeight - y - height,
        target: { framebuffer, height: framebufferHeight, clear: this.#clear } });
    }
  }
}
