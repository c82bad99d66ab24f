// Form, table and plot of benchmark.html. Parameters of the URL fill in the form; `run` starts the measurement at once:
//   benchmark.html?model=a.glb&model=b.glb&width=2000&height=1000&views=120&warmup=30&aa=none&run
import { Benchmark } from "./benchmark.js";
import { download, nameOf } from "./download.js";
import { SoupError } from "./error.js";

const PLOT_WIDTH = 800, PLOT_HEIGHT = 260, LEFT = 50, BOTTOM = 30, TOP = 10;
const COLOURS = { cameras: "#b5651d", hemisphere: "#1f5fa8" };
const NAMES = { cameras: "cameras of the models", hemisphere: "upper hemisphere" };

const form = document.querySelector("form"), message = document.getElementById("message"),
  table = document.querySelector("table");
const fields = form.elements;

function fillIn(parameters) {
  fields.models.value = (parameters.has("model") ? parameters.getAll("model") : ["model.glb"]).join("\n");
  for (const name of ["width", "height", "views", "warmup", "aa"])
    if (parameters.has(name)) fields[name].value = parameters.get(name);
}

async function models() {
  const addresses = fields.models.value.split("\n").map((line) => line.trim()).filter(Boolean);
  const signal = new AbortController().signal, onProgress = () => {};
  const loaded = addresses
    .map(async (address) => [await download(new URL(address, location.href).href, { signal, onProgress }),
      nameOf(address)]);
  const files = Array.from(fields.files.files, async (file) => [new Uint8Array(await file.arrayBuffer()), file.name]);
  const all = await Promise.all([...loaded, ...files]);
  if (all.length === 0) throw new SoupError("there is no model; give the URL of a model.glb or choose a file");
  return all;
}

/** Runs the benchmark with the values of the form. */
async function measure() {
  const wrong = Array.from(fields).find((field) => !field.checkValidity());
  if (wrong) throw new SoupError(`${wrong.name}: ${wrong.validationMessage}`);
  const number = (name) => fields[name].valueAsNumber;
  const options = { width: number("width"), height: number("height"), views: number("views"), warmup: number("warmup"),
    aa: fields.aa.value };
  message.textContent = "Loading the models.";
  table.hidden = document.getElementById("json").hidden = true;
  const canvas = document.createElement("canvas");
  document.getElementById("picture").replaceChildren(canvas);
  const benchmark = new Benchmark(canvas);
  for (const [bytes, name] of await models()) await benchmark.add(bytes, name);
  const result = await benchmark.run(options,
    (done) => { message.textContent = `Measuring: ${Math.round(100 * done)} %.`; });
  show(result);
  return { benchmark, options, result };
}

function show(result) {
  message.textContent =
    `${result.device}: ${result.scenes.length} at once, ${result.width} x ${result.height} pixels, ` +
    `${result.aa === "none" ? "one sample per pixel" : result.aa}, ` +
    `${(1e-6 * result.gpu_bytes).toFixed(0)} MB on the GPU. ${result.timer ? "" : "This browser has no GPU timer."}`;
  const rows = [["milliseconds per frame", "mean", "median", "90 %", "99 %", "frames shown per second"]];
  const row = (name, times, shown) => [name,
    ...["mean_ms", "p50_ms", "p90_ms", "p99_ms"].map((key) => times[key].toFixed(2)), shown];
  for (const set of Object.keys(NAMES)) {
    const times = result[set];
    if (!times) continue;
    rows.push(row(`${NAMES[set]} (${times.frames})`, times, times.display.per_second.toFixed(1)));
    if (times.gpu) rows.push(row("GPU timer", times.gpu, ""));
  }
  table.replaceChildren(...rows.map((cells, i) => {
    const line = document.createElement("tr");
    line.append(
      ...cells.map((text) => Object.assign(document.createElement(i === 0 ? "th" : "td"), { textContent: text })));
    return line;
  }));
  table.hidden = false;
  plot(result);
  const link = document.getElementById("json");
  if (link.href) URL.revokeObjectURL(link.href);
  link.href = URL.createObjectURL(new Blob([JSON.stringify(result, null, 2) + "\n"], { type: "application/json" }));
  link.hidden = false;
}

/** Plots the time of each view as a dot and the means as lines. */
function plot(result) {
  const canvas = document.getElementById("plot"), context = canvas.getContext("2d"),
    ratio = Math.min(3, devicePixelRatio);
  canvas.width = PLOT_WIDTH * ratio;
  canvas.height = PLOT_HEIGHT * ratio;
  context.scale(ratio, ratio);
  context.font = "12px system-ui, sans-serif";
  const sets = Object.keys(NAMES).filter((name) => result[name]),
    frames = Math.max(...sets.map((name) => result[name].frames));
  const times = (name) => result[name].gpu ?? result[name];
  const highest = 1.1 * Math.max(...sets.flatMap((name) => times(name).frame_ms)), right = PLOT_WIDTH - 10,
    low = PLOT_HEIGHT - BOTTOM;
  const x = (i) => LEFT + ((right - LEFT) * (i + 0.5)) / frames, y = (ms) => low - ((low - TOP) * ms) / highest;
  const step = tickOf(highest / 5);
  context.textBaseline = "middle";
  for (let i = 0; i * step <= highest; ++i) {
    context.fillStyle = "#ddd";
    context.fillRect(LEFT, y(i * step), right - LEFT, 1);
    context.fillStyle = "#555";
    context.textAlign = "right";
    context.fillText(`${Number((i * step).toPrecision(6))} ms`, LEFT - 6, y(i * step));
  }
  let at = LEFT;
  for (const name of sets) {
    context.fillStyle = COLOURS[name];
    times(name).frame_ms.forEach((ms, i) => context.fillRect(x(i) - 1.5, y(ms) - 1.5, 3, 3));
    context.fillRect(LEFT, y(times(name).mean_ms), right - LEFT, 1);
    context.textAlign = "left";
    const text = `${NAMES[name]}, mean ${times(name).mean_ms.toFixed(2)} ms`;
    context.fillText(text, at, PLOT_HEIGHT - 10);
    at += context.measureText(text).width + 24;
  }
  canvas.setAttribute("role", "img");
  canvas.setAttribute("aria-label", "milliseconds per frame, by view");
}

/** The smallest of 1, 2 or 5 times a power of ten that is at least `least`. */
function tickOf(least) {
  const power = 10 ** Math.floor(Math.log10(least));
  return power * [1, 2, 5, 10].find((factor) => factor * power >= least);
}

function start() {
  const button = form.querySelector("button");
  button.disabled = true;
  const outcome = measure();
  outcome
    .catch((error) => {
      if (!(error instanceof SoupError)) console.error(error);
      message.textContent = error.message;
    })
    .finally(() => { button.disabled = false; });
  return outcome;
}

form.addEventListener("submit", (event) => {
  event.preventDefault();
  start();
});
const parameters = new URLSearchParams(location.search);
fillIn(parameters);
/** Promise of the results, for scripts that drive this page; null without `run`. */
export const measured = parameters.has("run") ? start() : null;
