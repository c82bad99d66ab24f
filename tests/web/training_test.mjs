// The page of a training, as somebody uses it: looks, compares, pauses, saves, goes on, and is told of the end. The
// model has the bits of a training that nobody looked at. Screenshots are written to the scratch folder.
import assert from "node:assert/strict";
import { spawn, execFileSync } from "node:child_process";
import { existsSync, mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { fileURLToPath } from "node:url";
import { Browser } from "./browser.mjs";

const { TRISOUP_BIN: bin, TRISOUP_SCRATCH: scratch } = process.env;
const scene = fileURLToPath(new URL("../../assets/garden", import.meta.url));
const STEPS = 400, PATIENCE_MS = 60_000;
const options = (out) => [scene, "-o", join(scratch, out), "--overwrite", "--preset", "fast", "--knee", "0", "--steps",
  String(STEPS), "--triangles", "1000", "--backend", "cpu"];
let browser;

before(async () => {
  mkdirSync(join(scratch, "pictures"), { recursive: true });
  browser = await Browser.launch();
});
after(() => browser?.close());

/** Starts a program that serves. @returns {Promise<{url: string, ended: Promise<number>}>} */
async function serving(program, ...given) {
  const child = spawn(join(bin, program), [...given, "--serve", "0"], { stdio: ["ignore", "pipe", "ignore"] });
  const ended = new Promise((resolve) => child.on("exit", (code) => resolve(code)));
  const said = await new Promise((resolve, reject) => {
    child.stdout.setEncoding("utf8").once("data", resolve);
    child.on("exit", (code) => reject(new Error(`${program} ended (${code})`)));
  });
  return { url: said.split(" ")[0], ended, stop: () => child.kill() };
}

/** Waits until something is true in the page. */
const until = (page, condition, ...values) => page.run(async (source, patience, given) => {
  const holds = new Function(`return (${source})`)(), end = Date.now() + patience;
  while (!holds(...given)) {
    if (Date.now() > end) throw new Error(`does not come: ${source}`);
    await new Promise((resolve) => setTimeout(resolve, 20));
  }
}, String(condition), PATIENCE_MS, values);
const shot = async (page, name) => {
  const { data } = await page.send("Page.captureScreenshot", { format: "png" });
  writeFileSync(join(scratch, "pictures", `training-${name}.png`), Buffer.from(data, "base64"));
};
const click = (page, id) => page.run((which) => document.getElementById(which).click(), id);
const phase = (page) => page.run(() => document.getElementById("phase").textContent);
/** Mean of the pixels of a screenshot of the stage: [r, g, b], 0 to 255. */
const stageBox = (page) => page.run(() => {
  const { left, top, width, height } = document.getElementById("stage").getBoundingClientRect();
  return { left, top, width, height };
});

test("a training is watched, paused, compared, saved, and has the bits of one that was left alone", async () => {
  const training = await serving("soup-train", ...options("watched"));
  const page = await browser.page({ width: 1280, height: 800 });
  await page.open(training.url);
  await until(page, () => document.getElementById("soup").loaded);
  await click(page, "pause");
  await until(page, () => document.getElementById("phase").textContent === "paused");

  // With the photograph over it, the stage has its shape; the error of a picture is dark, not that of another.
  for (const mode of ["photograph", "slider", "error"]) {
    await page.run((which) => document.querySelector(`[data-mode=${which}][role=radio]`).click(), mode);
    await until(page, () => {
      const photograph = document.getElementById("photograph");
      return photograph.complete && photograph.naturalWidth > 0;
    });
    await page.run(() => new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve))));
    await shot(page, mode);
    const { width, height } = await stageBox(page);
    assert.ok(Math.abs(width - height) < 1, `the garden's photographs are square, the stage has ${width} x ${height}`);
  }
  await page.run(() => document.querySelector("[data-mode=rendering][role=radio]").click());
  const step = () => document.querySelector("#numbers dd").textContent, paused = await page.run(step);

  // Cameras in the scene: a click on one shows it.
  await page.run(() => {
    const soup = document.getElementById("soup"), { position, target, up } = soup.camera;
    soup.camera = { position: position.map((p, i) => target[i] + 2.5 * (p - target[i])), target, up };
  });
  await click(page, "show-frustums");
  await page.run(() => new Promise((resolve) => setTimeout(resolve, 500)));
  await shot(page, "cameras");
  const blue = await page.run(() => {
    const canvas = document.getElementById("frustums");
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    let count = 0;
    for (let i = 3; i < data.length; i += 4) count += data[i] > 0;
    return count;
  });
  assert.ok(blue > 1000, `frustums cover ${blue} pixels`);
  await click(page, "nearest");
  await until(page, () => document.getElementById("soup").camera.index !== null);
  const shown = await page.run(() => document.getElementById("soup").camera.index);
  assert.equal(await page.run(() => [...document.querySelectorAll("#strip button")]
    .findIndex((button) => button.getAttribute("aria-selected") === "true")), shown);

  await click(page, "save");
  await until(page, () => /^saved after step/.test(document.getElementById("message").textContent));
  assert.ok(existsSync(join(scratch, "watched", "checkpoint.safetensors")));
  assert.equal(await page.run(step), paused);
  await click(page, "pause");
  const models = page.run((patience) => new Promise((resolve, reject) => {
    document.getElementById("soup").addEventListener("model", ({ detail }) => resolve(detail), { once: true });
    setTimeout(() => reject(new Error("no new model comes")), patience);
  }), PATIENCE_MS);
  await models;
  assert.equal(await page.run(() => document.getElementById("soup").camera.index), shown, "the camera stays");
  await shot(page, "goes-on");
  assert.equal(await training.ended, 0);
  await until(page, () => document.getElementById("numbers").textContent.includes("SSIM"));
  assert.deepEqual(page.complaints.filter((line) => !/ERR_CONNECTION_REFUSED|GPU stall/.test(line)), []);
  await shot(page, "end");
  await page.close();

  execFileSync(join(bin, "soup-train"), [...options("alone"), "-q"]);
  assert.deepEqual(readFileSync(join(scratch, "watched", "model.glb")),
    readFileSync(join(scratch, "alone", "model.glb")));
});

test("a finished training is shown on a phone", async () => {
  const viewer = await serving("soup-view", join(scratch, "watched"));
  const page = await browser.page({ width: 390, height: 844, ratio: 3, touch: true });
  await page.open(viewer.url);
  await until(page, () => document.getElementById("soup").loaded &&
    document.querySelectorAll("#strip img").length > 0);
  assert.equal(await phase(page), "finished");
  assert.ok(await page.run(() => document.getElementById("buttons").hidden), "nothing can be paused");
  assert.equal(await page.run(() => document.documentElement.scrollWidth), 390);
  const small = await page.run(() => [...document.querySelectorAll("button")]
    .filter((button) => button.offsetParent && button.getBoundingClientRect().height < 44).map(({ id }) => id));
  assert.deepEqual(small, [], "buttons that a finger misses");
  await page.run(() => document.querySelector("[data-mode=slider][role=radio]").click());
  await until(page, () => document.getElementById("photograph").naturalWidth > 0);
  await page.run(() => new Promise((resolve) => setTimeout(resolve, 300)));
  await shot(page, "phone");
  await page.run(() => document.getElementById("panel").scrollIntoView());
  await shot(page, "phone-panel");
  assert.deepEqual(page.complaints.filter((line) => !/GPU stall/.test(line)), []);
  await page.close();
  viewer.stop();
});
