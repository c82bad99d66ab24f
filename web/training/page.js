// The page of a training: the model as it is now, and what there is to know beside it.
import { Comparison } from "./comparison.js";
import { Feed } from "./feed.js";
import { Frustums, nearestCamera } from "./frustums.js";
import { Panel } from "./panel.js";
import { Strip } from "./strip.js";

const node = (id) => document.getElementById(id);
const soup = node("soup");
const comparison = new Comparison({ stage: node("stage"), soup, photograph: node("photograph"),
  divider: node("divider"), buttons: document.querySelectorAll("#modes [role=radio]") });
const frustums = new Frustums(node("frustums"), soup);
const strip = new Strip(node("strip"), (camera) => soup.flyTo(camera));
const panel = new Panel(node);
let about = { cameras: [] }, shown = 0, loading = false;

function lookAround() {
  const { camera } = soup;
  if (!camera) return;
  comparison.camera = camera.index;
  strip.selected = camera.index;
  strip.nearest = nearestCamera(frustums.cameras, camera);
  frustums.draw();
}

/** Cameras of the model are in the order of those that the server tells. */
function meetCameras() {
  if (!soup.loaded || soup.cameras.length !== about.cameras.length) return;
  frustums.set(about.cameras.map((_, i) => soup.cameraAt(i)), about.cameras.map(({ test }) => test));
  lookAround();
}

async function showModel(number) {
  if (number === 0 || number === shown || loading) return;
  loading = true;
  if (shown === 0) {
    soup.src = `model.glb?${number}`;
    await new Promise((resolve) => soup.addEventListener("load", resolve, { once: true }));
    node("waiting").hidden = true;
    meetCameras();
  } else {
    await soup.replace(`model.glb?${number}`);
  }
  shown = number;
  loading = false;
  soup.dispatchEvent(new CustomEvent("model", { detail: number }));
}

const feed = new Feed({
  about(news) {
    about = news;
    panel.control = about.control;
    comparison.about = about.cameras;
    strip.set(about.cameras);
    meetCameras();
  },
  state(state) {
    panel.show(state, feed.points);
    showModel(state.model);
  },
  silent: (state) => panel.silent(state),
});
panel.feed = feed;

function showFrustums(show) {
  frustums.shown = show;
  node("show-frustums").setAttribute("aria-pressed", String(show));
}

const goToNearest = () => {
  const nearest = soup.camera ? nearestCamera(frustums.cameras, soup.camera) : null;
  if (nearest !== null) soup.flyTo(nearest);
};

soup.addEventListener("camerachange", () => requestAnimationFrame(lookAround));
node("show-frustums").addEventListener("click", () => showFrustums(!frustums.shown));
node("nearest").addEventListener("click", goToNearest);
node("reset").addEventListener("click", () => soup.resetCamera());
soup.addEventListener("click", ({ offsetX, offsetY }) => {
  const camera = frustums.at(offsetX, offsetY);
  if (camera !== null) soup.flyTo(camera);
});
addEventListener("keydown", (event) => {
  if (event.target.matches("button, input, a") || event.ctrlKey || event.metaKey || event.altKey) return;
  const actions = { Space: () => comparison.step(), KeyC: () => showFrustums(!frustums.shown), KeyG: goToNearest };
  const action = actions[event.code];
  if (!action) return;
  event.preventDefault();
  action();
});
new ResizeObserver(() => {
  frustums.draw();
  if (feed.state) panel.draw(feed.state, feed.points);
}).observe(document.body);
