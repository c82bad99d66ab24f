// Draws a soup with three.js for three_test.mjs.
import {
  DataUtils, DoubleSide, HalfFloatType, Mesh, MeshBasicMaterial, OrthographicCamera, PerspectiveCamera, PlaneGeometry,
  Raycaster, Scene, Vector2,
  Vector3, WebGLRenderTarget, WebGLRenderer,
} from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { SoupLoader } from "/web/three/soup-loader.js";

const load = async (address) => (await new GLTFLoader().register((parser) => new SoupLoader(parser))
  .loadAsync(address)).scene;
const model = load("/model.glb");
/** The same file as programs without the loader show it. */
const plain = new GLTFLoader().loadAsync("/model.glb").then(({ scene }) => scene);

function find(root) {
  let soup = null;
  root.traverse((object) => { soup ??= object.isSoup ? object : null; });
  return soup;
}

const renderers = new Map();
function rendererOf(size, options) {
  const key = JSON.stringify([size, options]);
  if (!renderers.has(key)) {
    renderers.set(key, new WebGLRenderer({ antialias: false, preserveDrawingBuffer: true, ...options }));
    renderers.get(key).setSize(...size, false);
  }
  return renderers.get(key);
}

/** Rows from the top, RGBA, as base64. */
function encoded(rgba, [width, height]) {
  let text = "";
  for (let y = height - 1; y >= 0; --y)
    text += String.fromCharCode(...rgba.subarray(4 * width * y, 4 * width * (y + 1)));
  return btoa(text);
}

function onCanvas(renderer, size) {
  const gl = renderer.getContext(), rgba = new Uint8Array(4 * size[0] * size[1]);
  gl.readPixels(0, 0, ...size, gl.RGBA, gl.UNSIGNED_BYTE, rgba);
  return encoded(rgba, size);
}

/** Drawn to a target that holds light; as sRGB. */
function throughTarget(renderer, draw, size) {
  const target = new WebGLRenderTarget(...size, { type: HalfFloatType }),
    halves = new Uint16Array(4 * size[0] * size[1]);
  renderer.setRenderTarget(target);
  draw();
  renderer.readRenderTargetPixels(target, 0, 0, ...size, halves);
  renderer.setRenderTarget(null);
  target.dispose();
  const display = (light) => (light <= 0.0031308 ? 12.92 * light : 1.055 * light ** (1 / 2.4) - 0.055);
  return encoded(Uint8Array.from(halves, (half) => Math.round(255 * display(DataUtils.fromHalfFloat(half)))), size);
}

async function loseContext(renderer) {
  const lost = renderer.getContext().getExtension("WEBGL_lose_context");
  const event = (name) => new Promise((resolve) => renderer.domElement.addEventListener(name, () => setTimeout(resolve),
    { once: true }));
  const gone = event("webglcontextlost"), back = event("webglcontextrestored");
  lost.loseContext();
  await gone;
  await new Promise((resolve) => setTimeout(resolve, 100));
  lost.restoreContext();
  await back;
}

/** In normalised coordinates of the model: all points with normal * x = distance, red. */
function planeOf({ normal, distance }) {
  const mesh = new Mesh(new PlaneGeometry(100, 100), new MeshBasicMaterial({ color: 0xff0000, side: DoubleSide })),
    n = new Vector3(...normal);
  mesh.position.copy(n).multiplyScalar(distance);
  mesh.quaternion.setFromUnitVectors(new Vector3(0, 0, 1), n);
  return mesh;
}

/**
 * A picture through one of the model's cameras, as base64 of RGBA.
 * @param {{address?: string, camera: number, size: number[], options?: object, plane?: object, moved?: boolean,
 *   cloned?: boolean, part?: number[], target?: boolean, lost?: boolean, baked?: boolean}} wanted options of the
 *   renderer; moved: soup and camera together; part: x y width height of the canvas that is drawn to; baked: the
 *   colours that programs without the loader show
 */
window.draw = async ({ address, camera: which, size, options = {}, plane, moved, cloned, part, target, lost, baked,
}) => {
  const original = await (address ? load(address) : model), root = cloned ? original.clone() : original,
    soup = find(root), renderer = rendererOf(size, options);
  const scene = new Scene().add(root), camera = new PerspectiveCamera(40, size[0] / size[1]);
  scene.background = soup.background;
  root.position.set(...(moved ? [3, -2, 5] : [0, 0, 0]));
  root.quaternion.setFromAxisAngle(new Vector3(1, 2, -1).normalize(), moved ? 0.8 : 0);
  scene.updateMatrixWorld();
  soup.lookThrough(camera, which);
  const unit = soup.getWorldScale(new Vector3()).x;
  Object.assign(camera, { near: unit * soup.model.near, far: unit * soup.model.far }).updateProjectionMatrix();
  if (baked) scene.remove(root).add(await plain);
  const mesh = plane ? planeOf(plane) : null;
  if (mesh) soup.add(mesh);
  const draw = () => renderer.render(scene, camera);
  if (lost) {
    draw();
    await loseContext(renderer);
  }
  if (part) {
    const box = [part[0], size[1] - part[1] - part[3], part[2], part[3]];
    renderer.setViewport(...box);
    renderer.setScissor(...box);
    renderer.setScissorTest(true);
  }
  if (!target) draw();
  const result = target ? throughTarget(renderer, draw, size) : onCanvas(renderer, size);
  renderer.setScissorTest(false);
  renderer.setViewport(0, 0, ...size);
  mesh?.removeFromParent();
  return result;
};

/** What becomes of another file. */
window.other = (address) => load(address).then((root) => (find(root) ? "a soup" : "no soup"), (error) => error.message);

/** Where the middle of a soup is in its scene. */
window.place = async (address) => {
  const root = await load(address);
  root.updateMatrixWorld(true);
  return find(root).getWorldPosition(new Vector3()).toArray();
};

/** What drawing without perspective says. */
window.flat = async () => {
  const scene = new Scene().add(await model), renderer = rendererOf([20, 20], {});
  try {
    renderer.render(scene, new OrthographicCamera(-100, 100, 100, -100, -100, 100));
    return "drawn";
  } catch (error) {
    return error.message;
  }
};

/** What a ray through the middle of a picture hits: distance, normalised. */
window.pick = async (which) => {
  const root = await model, soup = find(root), camera = new PerspectiveCamera(40, 1), ray = new Raycaster();
  root.updateMatrixWorld(true);
  soup.lookThrough(camera, which);
  camera.updateMatrixWorld();
  ray.setFromCamera(new Vector2(0, 0), camera);
  return ray.intersectObject(root, true).map(({ distance }) => distance / soup.getWorldScale(new Vector3()).x);
};
