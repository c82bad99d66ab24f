// Shows a soup with a ring through it. docs/viewer.md lists the files that the page needs.
import { Box3, Mesh, MeshNormalMaterial, PerspectiveCamera, Scene, TorusGeometry, Vector3, WebGLRenderer } from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { SoupLoader } from "./soup-loader.js";

const message = document.getElementById("message");

async function main() {
  const loader = new GLTFLoader().register((parser) => new SoupLoader(parser));
  const { scene: model } =
    await loader.loadAsync(new URLSearchParams(location.search).get("model") ?? "../../model.glb");
  let soup;
  model.traverse((object) => { if (object.isSoup) soup = object; });
  if (!soup) throw new Error("model.glb has no neural textures; give a model of soup-train");

  const renderer = new WebGLRenderer({ antialias: true });
  renderer.setPixelRatio(devicePixelRatio);
  document.body.append(renderer.domElement);
  const scene = new Scene(), camera = new PerspectiveCamera(40, innerWidth / innerHeight);
  scene.background = soup.background;
  scene.add(model);
  scene.updateMatrixWorld();

  soup.lookThrough(camera);
  const eye = camera.position.clone(), middle = soup.getWorldPosition(new Vector3()), distance = eye.distanceTo(middle);
  const size = Math.min(new Box3().setFromObject(soup).getSize(new Vector3()).length(), distance);
  const ring = new Mesh(new TorusGeometry(0.22 * size, 0.03 * size, 24, 96), new MeshNormalMaterial());
  ring.position.copy(middle);
  scene.add(ring);

  camera.clearViewOffset();
  camera.near = 0.01 * distance;
  camera.far = 20 * distance;
  const controls = new OrbitControls(camera, renderer.domElement);
  controls.target.copy(middle);
  controls.update();

  const draw = () => {
    ring.rotation.y = 0.3;
    renderer.render(scene, camera);
  };
  const resize = () => {
    camera.aspect = innerWidth / innerHeight;
    camera.updateProjectionMatrix();
    renderer.setSize(innerWidth, innerHeight);
    draw();
  };
  addEventListener("resize", resize);
  controls.addEventListener("change", draw);
  resize();
  message.hidden = true;
}

main().catch((error) => { message.textContent = error.message; });
