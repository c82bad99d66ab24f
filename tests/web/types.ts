// What scripts write with the types of web/tri-soup.d.ts: run compiles it, nothing executes it.
import type { CameraPath, NerfstudioPath } from "../../web/tri-soup.js";

const soup = document.querySelector("tri-soup");
if (soup === null) throw new Error("no element");
soup.camera = 3;
soup.camera = "name";
soup.camera = { position: [1, 2, 3], target: new Float32Array(3), fov: 40 };
soup.camera = { matrix: new Float64Array(16) };
const state = soup.camera;
if (state) {
  const [x, y, z]: number[] = state.position;
  soup.camera = { ...state, position: [x + 1, y, z] };
  const where: string = state.index === null ? "free" : soup.cameras[state.index];
  console.log(where, state.matrix.length);
}
const other = soup.cameraAt(3);
if (other) soup.camera = other;
soup.replace("later.glb").then((shown: boolean) => console.log(shown));
const path: CameraPath = { keyframes: [{ time: 0, position: [1, 2, 3], target: [0, 0, 0] }], loop: true };
const recorded: NerfstudioPath = { camera_path: [{ camera_to_world: [[1, 0, 0, 0]], fov: 50 }], fps: 24 };
const arrived: Promise<boolean> = soup.flyTo(0, { seconds: 1 });
arrived.then(() => soup.play(path)).then(() => soup.play(recorded, { dataparser: "dataparser_transforms.json" }));
soup.addEventListener("hotspot", ({ detail }) => console.log(detail.name.length, detail.position[0].toFixed()));
soup.addEventListener("progress", (event) => console.log(event.loaded / event.total));
soup.addEventListener("error", (event) => console.log(event.message));
soup.addEventListener("camerachange", function () { console.log(this.moving); });

// @ts-expect-error: only four kinds
soup.wheel = "sometimes";
// @ts-expect-error: is not to be set
soup.cameras = [];
// @ts-expect-error: it may be null
soup.camera.position[0] += 1;
// @ts-expect-error: a key frame has a time
soup.play({ keyframes: [{ position: [1, 2, 3] }] });
