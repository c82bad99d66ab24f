// web/benchmark.html in a headless Chromium: its views are those of soup-view --benchmark, and its figures are sane.
import assert from "node:assert/strict";
import { mkdirSync, readFileSync, readdirSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";
import { gridOf, statistics } from "../../web/benchmark.js";
import { SIZE, largePath, model, modelPath, native, on, pages, scratch } from "./harness.mjs";
import { readPng } from "./png.mjs";

/** Runs the page by its address; what it measured. */
const measured = (page) => page.run(async () => (await (await import("/web/benchmark_page.js")).measured).result);

/** Share of the pixels of a page's view that are others than soup-view's, and the largest difference of the rest. */
async function difference(page, options, index, expected) {
  const text = await page.run(async (o, i) => {
    const { benchmark } = await (await import("/web/benchmark_page.js")).measured;
    benchmark.show(o, i);
    const canvas = document.querySelector("#picture canvas"), copy = document.createElement("canvas"),
      context = copy.getContext("2d");
    Object.assign(copy, { width: canvas.width, height: canvas.height });
    context.drawImage(canvas, 0, 0);
    return btoa(Array.from(context.getImageData(0, 0, copy.width, copy.height).data,
      (byte) => String.fromCharCode(byte)).join(""));
  }, options, index);
  const rgba = Buffer.from(text, "base64");
  return { rgba, others: expected ? others(rgba, expected, options.width) : null };
}

/**
 * Pixels that differ by more than two steps: rgba is `width` wide, `expected` (RGB) is a part of it from `left`, `top`.
 */
function others(rgba, { width, height, rgb }, stride, left = 0, top = 0) {
  let count = 0;
  for (let y = 0; y < height; ++y)
    for (let x = 0; x < width; ++x) {
      const p = 4 * ((top + y) * stride + left + x), q = 3 * (y * width + x);
      if ([0, 1, 2].some((c) => Math.abs(rgba[p + c] - rgb[q + c]) > 2)) ++count;
    }
  return count / (width * height);
}

function views(path, size, frames) {
  const out = join(scratch, "hemisphere");
  native("soup-view", path, "--path", "hemisphere", "--frames", String(frames), "-o", out, "--size", size, "--aa",
    "none");
  return readdirSync(out).sort().slice(0, frames).map((name) => readPng(join(out, name)));
}

test("views are those of soup-view --benchmark, and the JSON says what was measured", () => {
  const expected = views(modelPath, `${SIZE}x${SIZE}`, 7);
  const options = { width: SIZE, height: SIZE, views: 7, aa: "none" };
  return on(`/web/benchmark.html?model=/model.glb&width=${SIZE}&height=${SIZE}&views=7&warmup=2&run`, async (page) => {
    const result = await measured(page);
    for (let i = 0; i < 7; ++i) {
      const { others: share } = await difference(page, options, i, expected[i]);
      assert.ok(share <= 0.001, `view ${i}: ${share} of the pixels are others`);
    }
    native("soup-view", modelPath, "--benchmark", "--frames", "7", "--size", `${SIZE}x${SIZE}`, "--json",
      join(scratch, "native.json"));
    const theirs = JSON.parse(readFileSync(join(scratch, "native.json"), "utf8"));
    for (const key of ["triangles", "opaque", "masked"]) assert.equal(result.scenes[0][key], theirs[key], key);
    for (const set of ["cameras", "hemisphere"]) {
      const ours = result[set];
      assert.equal(ours.frames, theirs[set].frames, `${set}: as many views`);
      assert.equal(ours.frame_ms.length, ours.frames);
      assert.ok(0 < ours.p50_ms && ours.p50_ms <= ours.p90_ms && ours.p90_ms <= ours.p99_ms &&
        ours.p99_ms <= Math.max(...ours.frame_ms));
      assert.ok(Math.min(...ours.frame_ms) <= ours.mean_ms && ours.mean_ms <= Math.max(...ours.frame_ms));
      assert.ok(ours.display.per_second > 0.1 && ours.display.per_second < 1000, `${ours.display.per_second}`);
      if (result.timer && ours.gpu) assert.ok(ours.gpu.frame_ms.every((ms) => ms >= 0), `${ours.gpu.frame_ms}`);
    }
    assert.ok(result.gpu_bytes > result.scenes[0].gpu_bytes && result.scenes[0].gpu_bytes > model.length / 4);
    assert.deepEqual([result.width, result.height, result.aa, result.warmup], [SIZE, SIZE, "none", 2]);
    assert.deepEqual(JSON.parse(await page.run(() => window.blobs.at(-1).text())), result,
      "what is saved is what was measured");
    assert.match(await page.run(() => document.getElementById("json").href), /^blob:/);
    mkdirSync(join(scratch, "pictures"), { recursive: true });
    writeFileSync(join(scratch, "pictures", "benchmark.png"), await page.screenshot());
  }, {
    wait: false, screen: { width: 900, height: 1000 },
    begin: () => {
      const { createObjectURL } = URL;
      window.blobs = [];
      URL.createObjectURL = (blob) => { window.blobs.push(blob); return createObjectURL(blob); };
    },
  });
});

test("three scenes at once lie side by side, each as it is alone", () => {
  pages["/large.glb"] = readFileSync(largePath);
  const size = { width: 240, height: 120 }, grid = gridOf(3, size.width, size.height);
  assert.deepEqual(grid, { width: 80, height: 120, columns: 3 });
  const alone = [modelPath, largePath].map((path) => views(path, `${grid.width}x${grid.height}`, 3)[2]);
  const models = "model=/model.glb&model=/large.glb&model=/model.glb";
  return on(`/web/benchmark.html?${models}&width=240&height=120&views=3&warmup=1&run`, async (page) => {
    const result = await measured(page);
    assert.deepEqual(result.scenes.map((scene) => scene.model), ["model.glb", "large.glb", "model.glb"]);
    const { rgba } = await difference(page, { ...size, views: 3, aa: "none" }, 2, null);
    [alone[0], alone[1], alone[0]].forEach((expected, i) => {
      const share = others(rgba, expected, size.width, i * grid.width);
      assert.ok(share <= 0.002, `scene ${i}: ${share} of the pixels are others`);
    });
  }, { wait: false });
});

test("what cannot be measured is said in one line", async () => {
  const cases = [["model=/none.glb", /none\.glb: the server answers 404/], ["model=", /there is no model/],
    ["model=/model.glb&width=99999", /^width: /], ["model=/icon.png", /icon\.png: is not a binary glTF file/]];
  for (const [query, line] of cases)
    await on(`/web/benchmark.html?${query}&views=1&warmup=0&run`, async (page) => {
      const said = await page.run(async () => {
        await (await import("/web/benchmark_page.js")).measured.catch(() => {});
        return document.getElementById("message").textContent;
      });
      assert.match(said, line);
    }, { wait: false, allowed: [/Failed to load resource/] });
});

test("scenes are laid out as square as can be, and percentiles are those of soup-view", () => {
  assert.deepEqual(gridOf(14, 2000, 1000), { width: 400, height: 333, columns: 5 });
  assert.deepEqual(gridOf(1, 300, 200), { width: 300, height: 200, columns: 1 });
  const { frames, mean_ms: mean, p50_ms: p50, p90_ms: p90, p99_ms: p99 } =
    statistics(Array.from({ length: 101 }, (_, i) => 100 - i));
  assert.deepEqual([frames, mean, p50, p90, p99], [101, 50, 50, 90, 99]);
  assert.equal(statistics([]), null);
});
