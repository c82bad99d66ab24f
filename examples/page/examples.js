// The buttons of index.html.
const soupOf = (id) => document.getElementById(id);
const show = (id, text) => { document.getElementById(id).textContent = text; };
const onceLoaded = (soup) => new Promise((resolve) => {
  if (soup.loaded) resolve();
  else soup.addEventListener("load", () => resolve(), { once: true });
});

/** A point on the circle around a target, in the plane of a camera's position and its right direction. */
function around({ position, target, matrix }, angle) {
  const away = position.map((x, i) => x - target[i]), distance = Math.hypot(...away);
  return target.map((x, i) => x + Math.cos(angle) * away[i] + Math.sin(angle) * distance * matrix[i]);
}

const camera = soupOf("camera");
camera.addEventListener("camerachange", () =>
  show("pose", camera.camera.position.map((x) => x.toFixed(3)).join(", ")));
document.getElementById("closer").addEventListener("click", () => {
  const { position, target } = camera.camera;
  camera.flyTo({ position: position.map((x, i) => 0.5 * (x + target[i])), target });
});
document.getElementById("back").addEventListener("click", () => camera.resetCamera());

const path = soupOf("path");
path.addEventListener("timeupdate", () =>
  show("time", `${path.currentTime.toFixed(1)} of ${path.duration.toFixed(1)} s`));
document.getElementById("play").addEventListener("click", async () => {
  await onceLoaded(path);
  const start = path.camera, angles = [0, 0.4, 0.8, 0.4, 0, -0.4, -0.8, -0.4, 0];
  await path.play({ keyframes: angles.map((angle, i) =>
    ({ time: i, position: around(start, angle), target: start.target, up: start.up, fov: start.fov })) });
});

const hotspots = soupOf("hotspots");
onceLoaded(hotspots).then(() => {
  const { position, target } = hotspots.camera;
  const middle = Object.assign(document.createElement("button"), { slot: "hotspot-middle", textContent: "Middle" });
  middle.type = "button";
  middle.dataset.position = target.map((x, i) => 0.7 * x + 0.3 * position[i]).join(" ");
  middle.dataset.camera = "1";
  hotspots.append(middle);
});
hotspots.addEventListener("hotspot", ({ detail }) =>
  show("clicked", `${detail.name} at ${detail.position.map((x) => x.toFixed(3)).join(", ")}`));
