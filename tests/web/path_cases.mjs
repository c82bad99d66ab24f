// Cameras of camera paths as the page computes them: path_cases.json, which tests/host/camera_path_test.cpp reads too.
// `node tests/web/path_cases.mjs` writes the cameras into it again.
import { readFileSync, writeFileSync } from "node:fs";
import { fileURLToPath } from "node:url";
import { centre, fitted, row } from "../../web/camera.js";
import { readPath } from "../../web/path.js";
import { cameraOfShot, shotAt } from "../../web/shot.js";

const FILE = new URL("path_cases.json", import.meta.url);

export const pathCases = () => JSON.parse(readFileSync(FILE, "utf8"));

/** Position, axes as rows, and focal length in pixels of the camera at each time of a case. */
export function camerasOf({ document, dataparser, normalisation, up, fov, aspect, times, size }) {
  const { keys } = readPath(document, "case", { normalisation, up, now: { fov, aspect }, pivot: () => 1, dataparser });
  return times.map((time) => {
    const camera = fitted(cameraOfShot(shotAt(keys, time)), ...size);
    return { eye: centre(camera), axes: [0, 1, 2].flatMap((i) => row(camera, i)), focal: camera.fx };
  });
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  const cases = pathCases().map((one) => ({ ...one, cameras: camerasOf(one) }));
  writeFileSync(FILE, `[\n${cases.map((one) => JSON.stringify(one)).join(",\n")}\n]\n`);
}
